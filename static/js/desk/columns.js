// The measurements of a film as typed arrays, one element a frame, filled line by line. NaN stands for what was
// not measured. A film of an hour has 100,000 frames and more: arrays of numbers take a tenth of the memory of
// objects and cross from a worker without a copy.
// @ts-check

/** Points of a midline, from head to tail. */
export const MIDLINE = 11;
/** Head confidence below which a heading counts as unsure. */
export const SURE = 0.8;
/** Names of the columns with one number a frame. */
const SINGLE = /** @type {const} */ (["confidence", "head_confidence", "heading_rad", "bend_rad", "length_px", "height_px"]);
/** Half of the span over which the speed is measured, s. Shorter spans show the jitter of the silhouette. */
const SPEED_HALF_S = 0.07;

/**
 * @typedef {{n: number, fps: number, time_s: Float64Array, detected: Uint8Array, cut: Uint8Array,
 *   confidence: Float32Array, head_confidence: Float32Array, heading_rad: Float32Array, bend_rad: Float32Array,
 *   length_px: Float32Array, height_px: Float32Array, centroid_px: Float32Array, box_px: Float32Array,
 *   midline_px: Float32Array, speed_px_per_s: Float32Array, tail_beat_hz: Float32Array, sure_deg: Float32Array, unsure_deg: Float32Array,
 *   hasMidline: boolean, mostSpeed: number, mostBend: number, mostBeat: number}} Columns n: frames; mostSpeed, mostBend, mostBeat: nearly the
 *   greatest values, so that a single wrong frame does not flatten a plot
 */

/** Returns empty columns for at most `most` frames. @param {number} most @param {number} fps @returns {Columns} */
export function emptyColumns(most, fps) {
  const numbers = (/** @type {number} */ each) => new Float32Array(most * each).fill(NaN);
  const columns = { n: 0, fps, hasMidline: false, mostSpeed: 0, mostBend: 0, mostBeat: 0, time_s: new Float64Array(most), detected: new Uint8Array(most), cut: new Uint8Array(most), centroid_px: numbers(2), box_px: numbers(4), midline_px: new Float32Array(0), speed_px_per_s: numbers(1), tail_beat_hz: numbers(1), sure_deg: numbers(1), unsure_deg: numbers(1) };
  const single = Object.fromEntries(SINGLE.map((name) => [name, numbers(1)]));
  return /** @type {Columns} */ ({ ...columns, ...single });
}

/** Appends one frame of poses.json. @param {Columns} columns @param {Api.Pose} pose */
export function append(columns, pose) {
  const k = columns.n;
  columns.n += 1;
  columns.time_s[k] = pose.time_s ?? k / columns.fps;
  columns.detected[k] = pose.detected ? 1 : 0;
  columns.cut[k] = pose.cut ? 1 : 0;
  for (const name of SINGLE) columns[name][k] = pose[name] ?? NaN;
  if (pose.centroid_px) columns.centroid_px.set(pose.centroid_px, 2 * k);
  if (pose.box_px) columns.box_px.set(pose.box_px, 4 * k);
  if (!pose.midline_px) return;
  if (!columns.hasMidline) {
    columns.midline_px = new Float32Array(columns.time_s.length * 2 * MIDLINE).fill(NaN);
    columns.hasMidline = true;
  }
  pose.midline_px.slice(0, MIDLINE).forEach((point, i) => columns.midline_px.set(point, 2 * (MIDLINE * k + i)));
}

/**
 * Computes the speed and the two lines of the heading for frames `from` to `to`. The speed is that of motion.csv.
 * @param {Columns} columns
 */
export function derive(columns, from = 0, to = columns.n) {
  const { n, fps, centroid_px, time_s, heading_rad, head_confidence, speed_px_per_s, sure_deg, unsure_deg } = columns;
  const half = Math.max(1, Math.round(SPEED_HALF_S * fps));
  const isSure = (/** @type {number} */ k) => !(head_confidence[k] < SURE);
  for (let k = from; k < to; k++) {
    const [a, b] = [Math.max(0, k - half), Math.min(n - 1, k + half)];
    const path_px = Math.hypot(centroid_px[2 * b] - centroid_px[2 * a], centroid_px[2 * b + 1] - centroid_px[2 * a + 1]);
    speed_px_per_s[k] = time_s[b] > time_s[a] && !Number.isNaN(centroid_px[2 * k]) ? path_px / (time_s[b] - time_s[a]) : NaN;
    const degrees = (heading_rad[k] * 180) / Math.PI;
    sure_deg[k] = isSure(k) ? degrees : NaN;
    // A piece of line between a sure and an unsure moment is unsure.
    unsure_deg[k] = isSure(k) && (k === 0 || isSure(k - 1)) && (k === n - 1 || isSure(k + 1)) ? NaN : degrees;
  }
}

/** Writes the frequency of the tail beat of each span. @param {Columns} columns @param {{frames: number[], frequency_hz: number}[]} spans */
export function fillTailBeat({ tail_beat_hz, n }, spans) {
  for (const { frames: [from, to], frequency_hz } of spans) tail_beat_hz.fill(frequency_hz, from, Math.min(n, to));
}

/** Updates the greatest values, from every tenth frame of a long film. @param {Columns} columns */
export function measureRanges(columns) {
  const step = Math.max(1, Math.floor(columns.n / 10000));
  const most = (/** @type {Float32Array} */ values) => {
    const seen = [];
    for (let k = 0; k < columns.n; k += step) if (!Number.isNaN(values[k])) seen.push(Math.abs(values[k]));
    return Float32Array.from(seen).sort()[Math.floor(0.998 * (seen.length - 1))] ?? 0;
  };
  columns.mostSpeed = most(columns.speed_px_per_s);
  columns.mostBend = most(columns.bend_rad);
  columns.mostBeat = most(columns.tail_beat_hz);
}

/** Returns the first measured frame, at which film.mp4 begins. @param {Api.Library} library */
export const firstFrame = ({ params, fps }) => Math.round((params?.from_s ?? 0) * fps);

/** Returns the frame shown at a time. @param {Columns} columns @param {number} time_s */
export function frameAt({ n, time_s: times }, time_s) {
  let [low, high] = [0, Math.max(0, n - 1)];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time_s + 1e-6) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * Returns the point of the head: the first of the midline, else half a length ahead of the centroid, at most at the
 * border of the box, which a foreshortened animal does not fill; null if unknown.
 * @param {Columns} columns @param {number} k
 */
export function headOf({ midline_px, centroid_px, box_px, heading_rad, length_px, hasMidline }, k) {
  if (hasMidline && !Number.isNaN(midline_px[2 * MIDLINE * k])) return [midline_px[2 * MIDLINE * k], midline_px[2 * MIDLINE * k + 1]];
  if (Number.isNaN(heading_rad[k])) return null;
  const [x, y] = centroid_px.subarray(2 * k, 2 * k + 2);
  const [left, top, w, h] = box_px.subarray(4 * k, 4 * k + 4);
  const [cos, sin] = [Math.cos(heading_rad[k]), Math.sin(heading_rad[k])];
  const borders = [(cos > 0 ? left + w - x : left - x) / cos, (sin > 0 ? top + h - y : top - y) / sin].filter((far) => far > 0);
  const far = Math.min(length_px[k] / 2, ...borders);
  return [x + far * cos, y + far * sin];
}
