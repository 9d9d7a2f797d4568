// Chooses how a canvas is drawn, and keeps its resolution at that of the screen.
// @ts-check
import { glDrawer } from "./gl.js";

/**
 * @typedef {{picture?: ImageBitmap, color?: number[]}} Background a picture, or a color of three shares from 0
 *   to 1; neither is transparent and shown as checkers
 * @typedef {{atlas: import("./atlas.js").Atlas, background: Background, sizePx: number[],
 *   haze: {perBl: number, lengthPx: number, color: number[]}}} Scene what stays from frame to frame
 * @typedef {{appearances: import("./appearance.js").Appearance[], opacity: number}} Layer
 * @typedef {{setScene: (scene: Scene) => void, draw: (layers: Layer[]) => void,
 *   dispose: () => void}} Drawer `dispose` gives up the context: the canvas cannot be drawn on after it
 */

/** Pixels of the canvas per pixel of the film beyond which nothing looks sharper. */
const MOST_ZOOM = 2;

/**
 * The canvas takes the shape of the picture; its style decides the size. All scenes have pictures of one size.
 * @param {HTMLCanvasElement} canvas @param {Scene} scene
 * @param {{onResize?: () => void}} [options]
 * @returns {Promise<Drawer>}
 */
export async function createDrawer(canvas, scene, { onResize = () => {} } = {}) {
  const drawer = glDrawer(canvas, scene) ?? (await import("./canvas2d.js")).canvasDrawer(canvas, scene);
  const [width, height] = scene.sizePx;
  const fit = () => {
    const zoom = Math.min(MOST_ZOOM, Math.min(canvas.clientWidth / width, canvas.clientHeight / height) * devicePixelRatio || 1);
    const size = scene.sizePx.map((side) => Math.round(side * zoom));
    if (canvas.width === size[0] && canvas.height === size[1]) return;
    [canvas.width, canvas.height] = size;
    onResize();
  };
  const observer = new ResizeObserver(fit);
  observer.observe(canvas);
  fit();
  return { ...drawer, dispose: () => { observer.disconnect(); drawer.dispose(); } };
}

/**
 * Returns the scene of a plan, with the background that its parameters name.
 * @param {import("./plan.js").Plan} plan @param {import("./atlas.js").Atlas} atlas
 * @param {ImageBitmap} picture background.png of the library @returns {Scene}
 */
export function sceneOf({ head, sizePx, lengthPx }, atlas, picture) {
  const { background = "plate", haze_per_bl: perBl = 0 } = head.params?.render ?? {};
  const digits = /^#(..)(..)(..)$/.exec(background)?.slice(1);
  return {
    atlas, sizePx,
    background: digits ? { color: digits.map((pair) => parseInt(pair, 16) / 255) } : background === "transparent" ? {} : { picture },
    haze: { perBl, lengthPx, color: perBl > 0 ? meanOf(picture) : [0, 0, 0] },
  };
}

/** Mean colors of pictures. @type {WeakMap<ImageBitmap, number[]>} */
const means = new WeakMap();

/** Returns the mean color of a picture: the color of haze. @param {ImageBitmap} picture */
function meanOf(picture) {
  const mean = means.get(picture) ?? measuredMean(picture);
  means.set(picture, mean);
  return mean;
}

/** @param {ImageBitmap} picture */
function measuredMean(picture) {
  const { width, height } = picture;
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, width, height);
  const sum = [0, 0, 0];
  for (let k = 0; k < data.length; k++) if (k % 4 < 3) sum[k % 4] += data[k];
  return sum.map((value) => value / (width * height * 255));
}

/**
 * Returns the point of the picture under the pointer. The picture is centered in its canvas and keeps its shape.
 * @param {HTMLCanvasElement} canvas @param {number[]} sizePx @param {{clientX: number, clientY: number}} event
 */
export function pointOf(canvas, [width, height], { clientX, clientY }) {
  const box = canvas.getBoundingClientRect();
  const zoom = Math.min(box.width / width, box.height / height) || 1;
  return [(clientX - box.left - (box.width - width * zoom) / 2) / zoom, (clientY - box.top - (box.height - height * zoom) / 2) / zoom];
}
