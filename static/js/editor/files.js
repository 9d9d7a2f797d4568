// Files beside the film: a picture of the empty scene, and masks of the animal. With them, the film is stored again.
// @ts-check
import { request } from "../app/api.js";
import { element } from "../app/element.js";
import { say } from "../app/words.js";

/** Types of the files that can be chosen, for each parameter. */
const ACCEPT = { background: "image/*", masks: "video/*,.zip,.tif,.tiff,.mkv,.avi" };

/** @param {Api.Footage} film @param {import("../app/store.js").Signal<Record<string, File | null>>} files */
export function fileFields(film, files) {
  const known = { background: film.has_background, masks: film.has_masks };
  const field = (/** @type {"background" | "masks"} */ name) => {
    const input = element("input", { type: "file", name, accept: ACCEPT[name], onchange: () => files.set({ ...files.value, [name]: input.files?.[0] ?? null }) });
    return element("label.field", {}, say(`editor.${name}`), input, element("small", {}, known[name] ? say("editor.file.known") : say(`editor.${name}.help`)));
  };
  return element("div.editor-files", {}, field("background"), field("masks"));
}

/** Returns the id of the film with these files, which the service makes. @param {string} filmId @param {Record<string, File | null>} files @param {AbortSignal} life */
export async function withFiles(filmId, files, life) {
  const chosen = Object.entries(files).flatMap(([name, file]) => (file ? [/** @type {const} */ ([name, file])] : []));
  if (!chosen.length) return filmId;
  const form = new FormData();
  for (const [name, file] of chosen) form.append(name, file);
  const answer = await request("POST", `/v1/footage/${filmId}/variants`, { body: form, signal: life });
  return /** @type {Api.Footage} */ (await answer.json()).id;
}
