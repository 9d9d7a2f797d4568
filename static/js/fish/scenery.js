// What stands around the fish: a floor with lines, the line from the fish down to it, and its way.
// @ts-check
import { isShownAt, placeAt } from "./posture.js";

/** @typedef {import("./glb.js").VirtualFish} VirtualFish */

/** Time of the way before and after the moment, s. */
const WAY_S = 2;
/** Share of the length of the fish between two lines of the floor. */
const SQUARE_BL = 1;
/** Most lines of the floor in one direction; within large bounds, its squares are larger. */
const MOST_LINES = 40;

/**
 * Returns the floor: below a fish filmed from the side, behind one filmed from above.
 * @param {{low: number[], high: number[]}} bounds @param {number} length of the fish @param {boolean} isFromAbove
 */
export function floorOf({ low, high }, length, isFromAbove) {
  const [across, along, up] = isFromAbove ? [0, 1, 2] : [0, 2, 1];
  const height = low[up] - 0.8 * length;
  const widest = Math.max(high[across] - low[across], high[along] - low[along]) + 4 * length;
  const square = Math.max(SQUARE_BL * length, widest / MOST_LINES);
  const ends = [across, along].map((axis) => {
    const middle = (low[axis] + high[axis]) / 2;
    const half = square * Math.ceil(((high[axis] - low[axis]) / 2 + 1.5 * length) / square);
    return [middle - half, middle + half];
  });
  const points = /** @type {number[]} */ ([]);
  const put = (/** @type {number} */ a, /** @type {number} */ b) => { const point = [0, 0, 0]; [point[across], point[along], point[up]] = [a, b, height]; points.push(...point); };
  for (let a = ends[0][0]; a < ends[0][1] + square / 2; a += square) { put(a, ends[1][0]); put(a, ends[1][1]); }
  for (let b = ends[1][0]; b < ends[1][1] + square / 2; b += square) { put(ends[0][0], b); put(ends[0][1], b); }
  return { lines: new Float32Array(points), up, height };
}

/** Returns the way of the fish around a frame as pieces of line; gaps stay open. @param {VirtualFish} fish @param {number} frame @param {number} fps */
export function wayOf(fish, frame, fps) {
  const half = Math.round(WAY_S * fps);
  const points = /** @type {number[]} */ ([]);
  for (let k = Math.max(1, frame - half); k <= Math.min(fish.nFrames - 1, frame + half); k++) {
    if (isShownAt(fish, k - 1) && isShownAt(fish, k)) points.push(...placeAt(fish, k - 1), ...placeAt(fish, k));
  }
  return new Float32Array(points);
}

/** Returns the line from the fish to the floor and a cross there. @param {number[]} place @param {{up: number, height: number}} floor @param {number} length */
export function plumbOf(place, { up, height }, length) {
  const foot = [...place];
  foot[up] = height;
  const points = [...place, ...foot];
  for (const axis of [0, 1, 2].filter((one) => one !== up)) {
    for (const side of [-0.15, 0.15]) points.push(...foot.map((value, k) => value + (k === axis ? side * length : 0)));
  }
  return new Float32Array(points);
}
