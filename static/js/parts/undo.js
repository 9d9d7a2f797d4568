// Deletions that can be undone: the thing vanishes from the page at once. The service deletes it when the time to
// undo is over.
// @ts-check
import { remove } from "../app/api.js";
import { element } from "../app/element.js";
import { forget } from "../app/names.js";
import { signal } from "../app/store.js";
import { say } from "../app/words.js";
import { reasonOf } from "./problem.js";

/** Time in which a deletion can be undone, ms. */
const UNDO_MS = 10_000;

/** Ids of things that are deleted or about to be. Lists leave them out. @type {import("../app/store.js").Signal<Set<string>>} */
export const deleted = signal(new Set());

/** Deletions that wait, by path. @type {Map<Api.Address<"delete">, number>} */
const waiting = new Map();
/** @type {HTMLElement | null} */
let notes = null;

/** @param {string} id @param {boolean} isDeleted */
function mark(id, isDeleted) {
  const next = new Set(deleted.value);
  if (isDeleted) next.add(id); else next.delete(id);
  deleted.set(next);
}

/**
 * Deletes a thing after the time to undo. Leaving the page deletes it at once.
 * @param {{id: string, path: Api.Address<"delete">, name: string}} thing @returns {{focus: () => void}} the button that undoes it
 */
export function deleteLater({ id, path, name }) {
  if (!notes) {
    notes = element("div.undo-notes", { role: "status" });
    document.body.append(notes);
    addEventListener("pagehide", deleteWaiting);
  }
  const button = element("button", { type: "button", onclick: undo }, say("undo"));
  const text = element("span", {}, say("undo.deleted", { name }));
  const note = element("p.undo-note", {}, text, button);
  notes.append(note);
  mark(id, true);
  waiting.set(path, setTimeout(finish, UNDO_MS));

  function undo() {
    clearTimeout(waiting.get(path));
    if (!waiting.delete(path)) return;
    close();
    mark(id, false);
  }
  async function finish() {
    if (!waiting.delete(path)) return;
    try {
      await remove(path).catch((problem) => { if (problem.status !== 404) throw problem; });
      forget(path);
      close();
    } catch (problem) {
      mark(id, false);
      text.textContent = say("undo.failed", { name, reason: await reasonOf(problem) });
      button.replaceWith(element("button", { type: "button", onclick: close }, say("dismiss")));
    }
  }
  function close() {
    const hadFocus = note.contains(document.activeElement);
    note.remove();
    if (hadFocus) /** @type {HTMLElement | null} */ (document.querySelector("#place h1"))?.focus({ preventScroll: true });
  }
  return { focus: () => button.focus() };
}

function deleteWaiting() {
  for (const [path, timer] of waiting) {
    clearTimeout(timer);
    fetch(path, { method: "DELETE", keepalive: true }).catch(() => {});
  }
  waiting.clear();
  // A browser may show the page again as it was.
  notes?.replaceChildren();
}
