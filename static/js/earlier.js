// The lists of earlier libraries and flocks.
// @ts-check
import { byId, element } from "./element.js";
import { count, day } from "./words.js";

/**
 * @param {any[]} libraries @param {any[]} flocks
 * @param {{library: string | null, flock: string | null}} current
 * @param {{onLibrary: (id: string) => void, onFlock: (id: string) => void}} callbacks
 */
export function showEarlier(libraries, flocks, current, { onLibrary, onFlock }) {
  const nameOf = (id) => libraries.find((library) => library.id === id)?.name || "Film";
  byId("earlier").hidden = libraries.length === 0;
  byId("earlier-libraries").replaceChildren(...libraries.map((library) =>
    entry(library.id, library.id === current.library, nameOf(library.id), day(library.created_at), () => onLibrary(library.id))));
  byId("earlier-flocks").replaceChildren(...flocks.map((flock) =>
    entry(flock.library_id, flock.id === current.flock, `${count(flock.count)} of “${nameOf(flock.library_id)}”`,
      `${count(flock.frames)} frames, seed ${flock.seed} · ${day(flock.created_at)}`, () => onFlock(flock.id))));
}

function entry(libraryId, isCurrent, title, more, onChoose) {
  const picture = element("img", { src: `/v1/libraries/${libraryId}/background.png`, alt: "", loading: "lazy" });
  const button = element("button", { type: "button", "aria-current": String(isCurrent) }, picture, element("strong", {}, title), element("small", {}, more));
  button.addEventListener("click", onChoose);
  return element("li", {}, button);
}
