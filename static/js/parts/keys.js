// Keys of a place: they work on the whole page, except where the focused element needs the key itself.
// @ts-check

/**
 * Listens for keys until `life` ends. Fields and open dialogs keep their keys, and buttons keep Space.
 * @param {AbortSignal} life @param {Record<string, (event: KeyboardEvent) => void>} acts what each key does, by its
 *   name; letters are small
 * @param {Element} [own] a field whose keys are these
 */
export function listenForKeys(life, acts, own) {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || (event.target !== own && isTaken(event))) return;
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  }, { signal: life });
}

/** Returns whether the focused element needs the key itself. @param {KeyboardEvent} event */
function isTaken({ key, target }) {
  if (document.querySelector("dialog[open]")) return true;
  if (!(target instanceof Element)) return false;
  if (target.matches("input:not([type=checkbox], [type=radio]), select, textarea")) return true;
  if (target.matches("[role=tab], input[type=radio], .table-scroll, pre") && (key.startsWith("Arrow") || key === "Home" || key === "End")) return true;
  return key === " " && target.closest("button, a, summary, input, [role=button]") !== null;
}
