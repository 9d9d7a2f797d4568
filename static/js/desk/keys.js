// Keys of the desk. They do nothing while a field has the focus or a dialog is open.
// @ts-check

/**
 * @param {AbortSignal} life
 * @param {{player: import("./player.js").Player, desk: import("./instrument.js").Instrument, axis: {zoomIn: () => void, zoomOut: () => void}, nextJump: () => void, focusFrame: () => void}} parts
 */
export function startKeys(life, { player, desk, axis, nextJump, focusFrame }) {
  const jump = (/** @type {number} */ frame) => () => { player.pause(); desk.goTo(frame); };
  /** @type {Record<string, (event: KeyboardEvent) => void>} */
  const acts = {
    " ": player.toggle,
    ArrowLeft: (event) => player.move(event.shiftKey ? -10 : -1),
    ArrowRight: (event) => player.move(event.shiftKey ? 10 : 1),
    Home: jump(desk.first),
    End: () => jump(desk.last())(),
    j: nextJump,
    m: () => desk.showsMirrored.set(!desk.showsMirrored.value),
    g: focusFrame,
    "+": axis.zoomIn,
    "=": axis.zoomIn,
    "-": axis.zoomOut,
  };
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || isTaken(event)) return;
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  }, { signal: life });
}

/** Returns whether the focused element needs the key itself. @param {KeyboardEvent} event */
function isTaken({ key, target }) {
  const node = /** @type {HTMLElement} */ (target);
  if (document.querySelector("dialog[open]")) return true;
  if (node.matches?.("input:not([type=checkbox]):not([type=radio]), select, textarea")) return true;
  if (node.matches?.("[role=tab], input[type=radio]") && (key.startsWith("Arrow") || key === "Home" || key === "End")) return true;
  return key === " " && Boolean(node.closest?.("button, a, summary, input, [role=button]"));
}
