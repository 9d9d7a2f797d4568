// The boxes and ids of the ground truth, drawn in pixels of the video.
// @ts-check
import { colorOf } from "./shapes.js";

/** Size of the ids, pixels of the screen. */
const ID_PX = 12;
/** Share of an animal that is seen, below which it counts as hidden in part. */
export const WHOLE = 0.995;

/** Draws the visible box, and with dashes the box of the whole animal if a part is hidden. @param {CanvasRenderingContext2D} context @param {import("./tracks.js").Track} track @param {number} px a pixel of the screen */
export function strokeBoxes(context, { id, visible, amodal, visibility }, px) {
  const stroke = (/** @type {number[]} */ [x, y, w, h], /** @type {number[]} */ dashes) => {
    for (const [color, width] of /** @type {[string, number][]} */ ([["#0a1114b0", 4], [colorOf(id), 2]])) {
      context.setLineDash(dashes);
      context.strokeStyle = color;
      context.lineWidth = width * px;
      context.strokeRect(x, y, w, h);
    }
    context.setLineDash([]);
  };
  if (amodal && visibility < WHOLE) stroke(amodal, [4 * px, 4 * px]);
  if (visible) stroke(visible, []);
}

/** @param {CanvasRenderingContext2D} context @param {import("./tracks.js").Track} track @param {number} px */
export function writeId(context, { id, visible, amodal, x, y }, px) {
  const box = visible ?? amodal ?? [x, y, 0, 0];
  const text = String(id);
  context.font = `600 ${ID_PX * px}px system-ui, sans-serif`;
  const width = context.measureText(text).width + 6 * px;
  context.fillStyle = "#0a1114d0";
  context.fillRect(box[0], box[1] - 15 * px, width, 15 * px);
  context.fillStyle = colorOf(id);
  context.fillText(text, box[0] + 3 * px, box[1] - 3.5 * px);
}
