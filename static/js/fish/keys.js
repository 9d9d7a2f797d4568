// Keys of film and fish: those of the desk, and + - 0 for the 3-D view.
// @ts-check

const FAR = 10;
const ZOOM = 1.25;

/**
 * @param {AbortSignal} life
 * @param {{move: (frames: number) => void, go: (frame: number) => void, last: number, toggle: () => void, orbit?: import("./orbit.js").Orbit}} acts
 */
export function startKeys(life, { move, go, last, toggle, orbit }) {
  /** @type {Record<string, (event: KeyboardEvent) => void>} */
  const known = {
    " ": toggle,
    ArrowLeft: ({ shiftKey }) => move(shiftKey ? -FAR : -1),
    ArrowRight: ({ shiftKey }) => move(shiftKey ? FAR : 1),
    Home: () => go(0),
    End: () => go(last),
    "+": () => orbit?.zoom(ZOOM),
    "=": () => orbit?.zoom(ZOOM),
    "-": () => orbit?.zoom(1 / ZOOM),
    0: () => orbit?.reset(),
  };
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || isTaken(event)) return;
    const act = known[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  }, { signal: life });
}

/** Returns whether the focused element needs the key itself. @param {KeyboardEvent} event */
function isTaken({ key, target }) {
  const node = /** @type {HTMLElement} */ (target);
  if (node.matches?.("input:not([type=checkbox]):not([type=radio]), select, textarea")) return true;
  if (node.matches?.("input[type=radio], .table-room") && (key.startsWith("Arrow") || key === "Home" || key === "End")) return true;
  return key === " " && Boolean(node.closest?.("button, a, summary, input"));
}
