// The heading of every frame as lines, broken where it crosses from 180 to -180 degrees.
// @ts-check
import { degrees } from "./words.js";

const SURE = 0.8;

/** @typedef {{x: number, y: number, sure: boolean} | null} Point x frames, y degrees; null breaks the line */

/** @param {any} poses @param {number} most limit of frames drawn, at even steps @returns {Point[]} */
export function headingPoints(poses, most) {
  const step = Math.max(1, Math.ceil(poses.frames.length / most));
  const points = /** @type {Point[]} */ ([]);
  let last = /** @type {Point} */ (null);
  for (let x = 0; x < poses.frames.length; x += step) {
    const { heading_rad, head_confidence } = poses.frames[x];
    if (heading_rad === null || heading_rad === undefined) {
      points.push(null);
      last = null;
      continue;
    }
    const point = { x, y: degrees(heading_rad), sure: (head_confidence ?? 1) >= SURE };
    if (last && Math.abs(point.y - last.y) > 180) points.push(...overTheCut(last, point));
    points.push(point);
    last = point;
  }
  return points;
}

/** Returns the points at which the line leaves the plot and enters it again. */
function overTheCut(from, to) {
  const side = from.y > 0 ? 180 : -180;
  const turn = to.y + 2 * side - from.y;
  const x = from.x + (to.x - from.x) * ((side - from.y) / turn);
  return [{ x, y: side, sure: to.sure }, null, { x, y: -side, sure: to.sure }];
}

/** Returns an SVG path of either the sure or the unsure segments. */
export function pathOf(points, sure) {
  let path = "";
  let drawing = false;
  points.forEach((point, index) => {
    const previous = points[index - 1];
    if (!point || point.sure !== sure) { drawing = false; return; }
    if (!drawing && previous) path += `M${previous.x.toFixed(2)} ${previous.y.toFixed(1)}`;
    path += `${drawing || previous ? "L" : "M"}${point.x.toFixed(2)} ${point.y.toFixed(1)}`;
    drawing = true;
  });
  return path;
}
