// Pictures of the animal in single frames: sprites of the atlas, or cuts out of the film where there is no atlas.
// @ts-check
import { releaseVideo } from "../app/element.js";
import { viewsState } from "../app/names.js";
import { loadAtlas } from "../flock/atlas.js";
import { hasFile } from "./instrument.js";

/** Side of what is shown around the animal, in sides of its box. */
const AROUND = 1.25;

/** @typedef {ReturnType<typeof createPictures>} Pictures */
/** @typedef {{frame: number, canvas: HTMLCanvasElement, mirrored: boolean}} Wish */

/** @param {import("./instrument.js").Instrument} desk */
export function createPictures(desk) {
  const { library } = desk;
  const base = `/v1/libraries/${library.id}/`;
  /** @type {import("../flock/atlas.js").Atlas | null} */
  let atlas = null;
  // Libraries of earlier versions have no atlas.
  const loaded = hasFile(library, "atlas.json") ? loadAtlas(base, { signal: desk.life }).then((found) => { atlas = found; return true; }).catch(() => false) : Promise.resolve(false);
  desk.life.addEventListener("abort", () => atlas?.close());

  /** Draws the sprite of a frame with its centroid at x, y. Returns whether there is one. @param {CanvasRenderingContext2D} context @param {number} frame @param {{x: number, y: number, zoom: number, mirrored?: boolean}} place zoom: CSS pixels per pixel of the film */
  function drawSprite(context, frame, { x, y, zoom, mirrored = false }) {
    const sprite = atlas?.spriteOf(frame);
    if (!atlas || !sprite) return false;
    const scale = zoom / atlas.scale;
    context.save();
    context.translate(x, y);
    context.scale(mirrored ? -scale : scale, scale);
    context.drawImage(atlas.pages[sprite.page], sprite.x, sprite.y, sprite.w, sprite.h, sprite.x - sprite.cx, sprite.y - sprite.cy, sprite.w, sprite.h);
    context.restore();
    return true;
  }

  /** Returns the zoom at which every sprite fits into a side. @param {number} side CSS pixels */
  const zoomFor = (side) => side / (AROUND * Math.max(40, 1.2 * (library.length_px ?? 100)));

  // A second copy of the film shows other moments than the player's.
  /** @type {HTMLVideoElement | null} */
  let scout = null;
  /** @type {Wish[]} */
  let wanted = [];
  const next = () => {
    const first = wanted[0];
    if (!first || !scout) return;
    scout.currentTime = (first.frame - desk.first + 0.5) / library.fps;
  };
  const arrived = () => {
    const first = wanted.shift();
    if (first) cut(first);
    next();
  };
  /** @param {Wish} wish */
  function cut({ frame, canvas, mirrored }) {
    const { columns: { value: columns } } = desk;
    if (!scout || frame >= columns.n || !columns.detected[frame]) return;
    const zoom = scout.videoWidth / library.image_size_px[0];
    const [x, y] = columns.centroid_px.subarray(2 * frame, 2 * frame + 2);
    const side = AROUND * Math.max(40, 1.2 * (library.length_px ?? 100));
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    context.setTransform(mirrored ? -1 : 1, 0, 0, 1, mirrored ? canvas.width : 0, 0);
    context.drawImage(scout, (x - side / 2) * zoom, (y - side / 2) * zoom, side * zoom, side * zoom, 0, 0, canvas.width, canvas.height);
  }

  /** Fills small canvases with the animal of some frames; forgets earlier wishes. @param {Wish[]} wishes */
  function fill(wishes) {
    for (const { canvas } of wishes) {
      const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, canvas.width, canvas.height);
    }
    const rest = wishes.filter(({ frame, canvas, mirrored }) => !drawSprite(/** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), frame, { x: canvas.width / 2, y: canvas.height / 2, zoom: zoomFor(canvas.width), mirrored }));
    if (viewsState(library) !== "done") return undefined;
    const isBusy = wanted.length > 0;
    wanted = [...wanted.slice(0, 1), ...rest];
    if (!rest.length || isBusy) return;
    if (scout) return next();
    scout = Object.assign(document.createElement("video"), { src: `${base}film.mp4`, muted: true, preload: "auto" });
    scout.addEventListener("seeked", arrived, { signal: desk.life });
    scout.addEventListener("error", () => { wanted = []; }, { signal: desk.life });
    scout.addEventListener("loadeddata", next, { once: true });
    desk.life.addEventListener("abort", () => { if (scout) releaseVideo(scout); });
    return undefined;
  }

  return { loaded, drawSprite, zoomFor, fill };
}
