// Cards of films and flocks in lists: picture, name, facts.
// @ts-check
import { element, svg } from "../app/element.js";
import { filmName, libraryOf } from "../app/names.js";
import { ago, say, seconds } from "../app/words.js";

/** Returns the address of a large picture of a flock: its poster, else a frame of the film. @param {Api.Flock} flock */
export const posterOf = (flock) => (flock.params.render?.formats?.includes("poster") ? `/v1/flocks/${flock.id}/poster.png` : `/v1/libraries/${flock.library_id}/poster.jpg`);

/** Returns the name of a flock, such as "20 × goldfish". @param {Api.Flock} flock */
export async function flockName(flock) {
  const film = await libraryOf(flock).then((library) => (library ? filmName(library) : say("film.deleted")), () => say("film.unnamed"));
  return say("flock.of", { n: flock.count, film });
}

/** Returns the card of a flock. @param {Api.Flock} flock */
export async function flockCard(flock) {
  const title = await flockName(flock);
  return element("li.card-small", {}, element("a", { href: `/flocks/${flock.id}` },
    flockPicture(flock),
    element("strong", {}, title), element("small", {}, [seconds(flock.frames / flock.fps), say("flock.seed", { seed: String(flock.seed) }), ago(flock.created_at)].join(" · "))));
}

/** Returns the card of a library without a flock: it leads to the studio. @param {Api.Library} library */
export const libraryCard = (library) => element("li.card-small", {}, element("a", { href: `/libraries/${library.id}/studio` },
  picture(`/v1/libraries/${library.id}/poster.jpg`), element("strong", {}, filmName(library)), element("small", {}, [say("film.measured"), ago(library.created_at)].join(" · "))));

/**
 * Returns the card of a film. @param {Api.Footage} footage
 * @param {{library?: Api.Library, state?: Node | string}} [known] the newest library of the film, and what is known of its measurement
 */
export const filmCard = (footage, { library, state = "" } = {}) => element("li.card-small", {}, element("a", { href: `/films/${footage.id}` },
  library ? picture(`/v1/libraries/${library.id}/poster.jpg`) : filmPicture(footage),
  element("strong", {}, filmName(footage)),
  element("small", {}, [seconds(footage.n_frames_hint / footage.fps), footage.image_size_px.join(" × ")].join(" · "))),
state);

/** @param {string} src */
const picture = (src) => element("img", { src, alt: "", loading: "lazy", width: 320, height: 180 });

/** Returns a small picture of a flock. Flocks of earlier versions have none; a frame of the film then stands for it. @param {Api.Flock} flock */
function flockPicture(flock) {
  const thumb = /** @type {HTMLImageElement} */ (picture(`/v1/flocks/${flock.id}/thumb.webp`));
  thumb.addEventListener("error", () => { thumb.src = posterOf(flock); }, { once: true });
  return thumb;
}

/** Returns a picture of a film that is not measured: its poster, else its first frame, else a fish. @param {Api.Footage} footage */
export function filmPicture(footage) {
  const poster = /** @type {HTMLImageElement} */ (picture(`/v1/footage/${footage.id}/poster.jpg`));
  poster.addEventListener("error", () => {
    const film = /** @type {HTMLVideoElement} */ (element("video", { src: `/v1/footage/${footage.id}/file#t=0.1`, muted: true, preload: "metadata", tabIndex: -1, "aria-hidden": "true" }));
    film.addEventListener("error", () => film.replaceWith(noPicture()));
    poster.replaceWith(film);
  });
  return poster;
}

/** Returns the picture of a film that this browser cannot show. */
export const noPicture = () => svg("svg", { class: "no-picture", viewBox: "0 0 32 32", "aria-hidden": "true" }, svg("use", { href: "/static/icon.svg#fish" }));
