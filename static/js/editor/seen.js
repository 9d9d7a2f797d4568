// Drawings of a preview of the measurement: outlines on the picture of the film, and a strip of the frames of the preview.
// @ts-check
import { drawnCanvas } from "../desk/canvas.js";

/** Width of a frame in the strip, and its distance from the ends of the axis above, px. */
const MARK_PX = 4;
const END_PX = 8;

/** Returns the frame of a preview that is nearest to a moment. @param {Api.Schemas["AnalysisPreview"] | null} seen @param {number} moment */
export function nearest(seen, moment) {
  const far = (/** @type {{frame: number}} */ one) => Math.abs(one.frame - moment);
  return seen?.frames.reduce((best, one) => (far(one) < far(best) ? one : best), seen.frames[0]);
}

/**
 * Draws the outline of the animal, and boxes around everything else that would differ from the background.
 * @param {CanvasRenderingContext2D} context @param {Api.Schemas["SeenFrame"]} seen @param {number} zoom @param {string} color
 */
export function drawSeen(context, { animal_px, others_px }, zoom, color) {
  const outline = new Path2D();
  for (const [x, y] of animal_px ?? []) outline.lineTo(x, y);
  outline.closePath();
  const others = new Path2D();
  for (const [x, y, w, h] of others_px) others.rect(x, y, w, h);
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(10 17 20 / 0.7)", 4], [color, 2]])) {
    [context.strokeStyle, context.lineWidth] = [style, wide / zoom];
    context.stroke(outline);
  }
  context.setLineDash([4 / zoom, 3 / zoom]);
  [context.strokeStyle, context.lineWidth] = ["#fff", 1 / zoom];
  context.stroke(others);
  context.setLineDash([]);
}

/**
 * Returns the strip, a mark for each frame: filled where the animal was found. @param {import("./film.js").Film} film
 * @param {import("./preview.js").Seen} seen @param {AbortSignal} life
 */
export function createStrip(film, seen, life) {
  const { canvas, ask } = drawnCanvas(life, ({ context, width, height, colors }) => {
    for (const { frame, animal_px } of seen.value?.frames ?? []) {
      const x = END_PX + (frame / Math.max(1, film.last)) * (width - 2 * END_PX) - MARK_PX / 2;
      context.fillStyle = animal_px ? colors.water : colors["line-strong"];
      context.fillRect(x, animal_px ? 0 : height - 3, MARK_PX, animal_px ? height : 3);
    }
  }, { className: "editor-strip", ariaHidden: "true" });
  seen.watch(ask, life);
  return canvas;
}
