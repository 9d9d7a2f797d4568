// The film of the editor: it shows one frame at a time. Where the browser cannot play the file that was sent, it shows
// the film of the measurement, if there is one, else a picture.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { signal } from "../app/store.js";
import { sent } from "../app/upload.js";
import { say } from "../app/words.js";
import { firstFrame } from "../desk/columns.js";

/** Part of a frame after its beginning at which it is sought, against rounding of its time. */
const WITHIN = 0.5;

/** @typedef {ReturnType<typeof createFilm>} Film */

/** @param {Api.Footage} film @param {{library?: Api.Library, frame: number, life: AbortSignal}} options */
export function createFilm(film, { library, frame, life }) {
  const moment = signal(frame);
  const isBroken = signal(false);
  const video = element("video", { src: sent.get(film.id) ?? `/v1/footage/${film.id}/file`, muted: true, playsInline: true, preload: "auto", "aria-label": say("home.film") });
  // The film of a measurement begins with the part that was measured.
  let first = 0;
  let rest = library ? [library] : [];
  let isSeeking = false;
  const seek = () => {
    const time_s = (Math.max(0, moment.value - first) + WITHIN) / film.fps;
    if (isSeeking || video.readyState < 1 || Math.abs(video.currentTime - time_s) < 1e-3) return;
    isSeeking = true;
    video.currentTime = time_s;
  };
  video.addEventListener("loadedmetadata", seek);
  video.addEventListener("seeked", () => { isSeeking = false; seek(); });
  video.addEventListener("error", () => {
    const [measured] = rest;
    if (life.aborted) return;
    if (!measured) return isBroken.set(true);
    rest = [];
    first = firstFrame(measured);
    video.src = `/v1/libraries/${measured.id}/film.mp4`;
    return undefined;
  });
  moment.watch(seek, life);
  life.addEventListener("abort", () => releaseVideo(video));
  const last = Math.max(0, film.n_frames_hint - 1);
  return { size: film.image_size_px, moment, video, isBroken, last, end_s: film.n_frames_hint / film.fps, picture: `/v1/footage/${film.id}/poster.jpg`, goTo: (/** @type {number} */ to) => moment.set(Math.min(last, Math.max(0, Math.round(to)))) };
}
