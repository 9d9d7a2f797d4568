// Draws a flock on a 2D canvas, for browsers without WebGL 2. Fades and haze are mixed on a spare canvas.
// @ts-check
import { CHECKERS, keptColor } from "./appearance.js";

/** @param {HTMLCanvasElement} canvas @param {import("./drawer.js").Scene} scene @returns {import("./drawer.js").Drawer} */
export function canvasDrawer(canvas, scene) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
  const spare = document.createElement("canvas");
  const mixing = /** @type {CanvasRenderingContext2D} */ (spare.getContext("2d"));

  /** @param {import("./drawer.js").Layer[]} layers */
  function draw(layers) {
    const zoom = canvas.width / scene.sizePx[0];
    drawBackground(context, scene.background, canvas);
    for (const { appearances, opacity } of layers) {
      context.globalAlpha = opacity;
      for (const one of appearances) {
        const [x, y, kept] = [one.x * zoom, one.y * zoom, keptColor(scene.haze, one.depth)];
        if (one.weight > 0 || kept < 1) drawMixed(one, kept, zoom, x, y);
        else drawSprite(context, one.main, zoom, x, y);
      }
    }
  }

  /**
   * Draws (1 - weight) * main + weight * second, hazed, and lays the sum over the canvas.
   * @param {import("./appearance.js").Appearance} one @param {number} kept @param {number} zoom @param {number} x @param {number} y
   */
  function drawMixed({ main, second, weight }, kept, zoom, x, y) {
    const reach = Math.ceil(Math.max(...[main, second ?? main].map(({ sprite, scale }) => scale * Math.hypot(sprite.w, sprite.h))) * (zoom / scene.atlas.scale)) + 1;
    const [side, left, top] = [2 * reach, Math.floor(x) - reach, Math.floor(y) - reach];
    if (spare.width < side) spare.width = spare.height = side;
    const begin = (/** @type {GlobalCompositeOperation} */ operation, /** @type {number} */ alpha) => {
      mixing.setTransform(1, 0, 0, 1, 0, 0);
      mixing.globalCompositeOperation = operation;
      mixing.globalAlpha = alpha;
    };
    begin("source-over", 1 - weight);
    mixing.clearRect(0, 0, side, side);
    drawSprite(mixing, main, zoom, x - left, y - top);
    begin("lighter", weight);
    if (second) drawSprite(mixing, second, zoom, x - left, y - top);
    begin("source-atop", 1 - kept);
    mixing.fillStyle = rgb(scene.haze.color);
    mixing.fillRect(0, 0, side, side);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(spare, 0, 0, side, side, left, top, side, side);
  }

  /**
   * Draws one sprite with its centroid at x, y of a canvas.
   * @param {CanvasRenderingContext2D} on @param {import("./appearance.js").Shown} shown @param {number} zoom @param {number} x @param {number} y
   */
  function drawSprite(on, { sprite, rotation, scale, mirrored }, zoom, x, y) {
    const size = (scale * zoom) / scene.atlas.scale;
    const [cos, sin, sign] = [Math.cos(rotation) * size, Math.sin(rotation) * size, mirrored ? -1 : 1];
    on.setTransform(sign * cos, sign * sin, -sin, cos, x, y);
    on.drawImage(scene.atlas.pages[sprite.page], sprite.x, sprite.y, sprite.w, sprite.h, sprite.x - sprite.cx, sprite.y - sprite.cy, sprite.w, sprite.h);
  }

  return { setScene: (next) => { scene = next; }, draw, dispose() {} };
}

/** @param {number} k */
const gray = (k) => Array(3).fill(CHECKERS.grays[k]);

/** @param {CanvasRenderingContext2D} context @param {import("./drawer.js").Background} background @param {HTMLCanvasElement} canvas */
function drawBackground(context, { picture, color }, { width, height }) {
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.fillStyle = rgb(color ?? gray(0));
  if (picture) context.drawImage(picture, 0, 0, width, height);
  else context.fillRect(0, 0, width, height);
  if (picture || color) return;
  context.fillStyle = rgb(gray(1));
  const { side } = CHECKERS;
  for (let y = 0; y < height; y += side) for (let x = y % (2 * side); x < width; x += 2 * side) context.fillRect(x, y, side, side);
}

/** @param {number[]} color */
const rgb = (color) => `rgb(${color.map((share) => Math.round(255 * share)).join(" ")})`;
