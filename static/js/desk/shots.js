// Still pictures out of the film: a frame, or the surroundings of a box in it, with the box or the measurement drawn
// over it. A copy of the film is opened when the first picture comes into view, and fills one picture after another.
// Until there is a film, the pictures show the background.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { watchViews } from "../app/names.js";
import { colorsAt, loadPicture } from "./canvas.js";
import { drawMarks } from "./marks.js";

/** Width of a picture in pixels, its shape, and what is shown around a box, in sides of the box. */
const [WIDE, SHAPE, AROUND] = [480, 4 / 3, 1.6];

/** @typedef {{frame: number, label: string, box_px?: number[], hasMarks?: boolean, around_px?: number[]}} Shot box_px is drawn; around_px: a box whose surroundings are shown, else the whole frame is */

/** @typedef {(shot: Shot) => HTMLElement} Shoot returns a picture that fills itself */

/** @param {import("./instrument.js").Instrument} desk @returns {Shoot} */
export function createShots(desk) {
  const { library, life } = desk;
  const [width, height] = library.image_size_px;
  /** @type {{shot: Shot, canvas: HTMLCanvasElement}[]} */
  const wanted = [];
  /** Pictures that were drawn without the film. @type {typeof wanted} */
  const early = [];
  /** @type {HTMLVideoElement | null} */
  let film = null;
  let [isOpen, isBroken] = [false, false];

  const seek = () => { if (film && wanted.length) film.currentTime = (wanted[0].shot.frame - desk.first + 0.5) / library.fps; };
  const arrived = () => {
    const one = wanted.shift();
    if (one && film) draw(one, film);
    seek();
  };
  const fail = async () => {
    isBroken = true;
    early.push(...wanted.splice(0));
    const background = await loadPicture(`/v1/libraries/${library.id}/background.png`, life);
    if (isBroken && background) for (const one of early) draw(one, background);
  };
  function open() {
    isOpen = true;
    watchViews(library, life, (state) => { if (state === "done") openFilm(); else void fail(); });
  }
  function openFilm() {
    isBroken = false;
    wanted.push(...early.splice(0));
    film = Object.assign(document.createElement("video"), { src: `/v1/libraries/${library.id}/film.mp4`, muted: true, preload: "auto" });
    film.addEventListener("loadeddata", seek, { once: true });
    film.addEventListener("seeked", arrived, { signal: life });
    film.addEventListener("error", () => void fail(), { signal: life });
    life.addEventListener("abort", () => { if (film) releaseVideo(film); });
  }
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      observer.unobserve(target);
      wanted.push({ shot: /** @type {Shot} */ (shots.get(target)), canvas: /** @type {HTMLCanvasElement} */ (target) });
      if (isBroken) void fail();
      else if (!isOpen) open();
      else if (film && wanted.length === 1 && film.readyState >= 2) seek();
    }
  }, { rootMargin: "200px" });
  life.addEventListener("abort", () => observer.disconnect());
  /** @type {WeakMap<Element, Shot>} */
  const shots = new WeakMap();

  /** @param {{shot: Shot, canvas: HTMLCanvasElement}} one @param {CanvasImageSource} source */
  function draw({ shot, canvas }, source) {
    const [x, y, w, h] = viewOf(shot);
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const zoom = canvas.width / w;
    context.setTransform(zoom, 0, 0, zoom, -x * zoom, -y * zoom);
    context.drawImage(source, 0, 0, width, height);
    // Lines are drawn for the width at which the picture is seen.
    const colors = colorsAt(canvas.parentElement ?? document.body);
    const shown = (canvas.clientWidth || canvas.width) / w;
    if (shot.hasMarks) drawMarks(context, desk.columns.value, shot.frame, { zoom: shown, colors, isMoving: false });
    if (!shot.box_px) return;
    for (const [color, wide] of /** @type {[string, number][]} */ ([["rgb(10 17 20 / 0.7)", 5], ["#ffd23f", 2.5]])) {
      context.strokeStyle = color;
      context.lineWidth = wide / shown;
      context.strokeRect(...(/** @type {[number, number, number, number]} */ (shot.box_px)));
    }
  }

  /** Returns the part of the frame that a picture shows. @param {Shot} shot */
  function viewOf({ around_px }) {
    if (!around_px) return [0, 0, width, height];
    const [x, y, w, h] = around_px;
    const wide = Math.min(width, height * SHAPE, Math.max(width / 4, AROUND * w, AROUND * h * SHAPE));
    const tall = wide / SHAPE;
    const within = (/** @type {number} */ start, /** @type {number} */ most) => Math.min(most, Math.max(0, start));
    return [within(x + w / 2 - wide / 2, width - wide), within(y + h / 2 - tall / 2, height - tall), wide, tall];
  }

  return (shot) => {
    const [, , w, h] = viewOf(shot);
    const canvas = element("canvas.shot", { width: WIDE, height: Math.round((WIDE * h) / w), role: "img", "aria-label": shot.label });
    shots.set(canvas, shot);
    observer.observe(canvas);
    return element("div.shot-box", {}, canvas);
  };
}
