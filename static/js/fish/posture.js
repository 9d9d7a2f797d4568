// The posture of the virtual fish in one frame: a matrix for each joint, and where it is and points.
// @ts-check
import { MOST_JOINTS } from "./glb.js";
import { multiply, rigid } from "./matrix.js";

/** @typedef {import("./glb.js").VirtualFish} VirtualFish */
/** @typedef {{skin: Float32Array, place: number[], forward: number[], isShown: boolean}} Posture
 *   skin: from the mesh at rest to space, a matrix a joint; place in metres and forward (unit vector), y up */

/** @param {VirtualFish} fish @param {number} frame @returns {Posture} */
export function postureAt(fish, frame) {
  const k = Math.min(fish.nFrames - 1, Math.max(0, frame));
  const place = placeAt(fish, k);
  let world = rigid(fish.turns.subarray(4 * k, 4 * k + 4), place);
  const forward = world.slice(0, 3);
  const skin = new Float32Array(16 * MOST_JOINTS);
  for (const [j, offset] of fish.offsets.entries()) {
    const bend = fish.bends[j]?.subarray(4 * k, 4 * k + 4) ?? [0, 0, 0, 1];
    world = multiply(world, rigid(bend, offset));
    skin.set(multiply(world, fish.inverse.subarray(16 * j, 16 * j + 16)), 16 * j);
  }
  return { skin, place, forward, isShown: isShownAt(fish, k) };
}

/** Returns the middle of the fish in a frame. @param {VirtualFish} fish @param {number} k */
export const placeAt = ({ places }, k) => [places[3 * k], places[3 * k + 1], places[3 * k + 2]];

/** @param {VirtualFish} fish @param {number} k */
export const isShownAt = ({ shown }, k) => !shown || shown[3 * k] > 0;

/** Returns the box that holds the middle of the fish in all frames in which it is shown. @param {VirtualFish} fish */
export function boundsOf(fish) {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let k = 0; k < fish.nFrames; k++) {
    if (!isShownAt(fish, k)) continue;
    for (const [axis, value] of placeAt(fish, k).entries()) [low[axis], high[axis]] = [Math.min(low[axis], value), Math.max(high[axis], value)];
  }
  return low[0] <= high[0] ? { low, high } : { low: placeAt(fish, 0), high: placeAt(fish, 0) };
}

/**
 * Returns the direction of the fish as the film shows it, radians, clockwise from the right, and how far it points
 * away from the camera (toward it below 0).
 * @param {Posture} posture
 */
export function directionOf({ forward: [x, y, z] }) {
  return { heading_rad: Math.atan2(-y, x), away_rad: Math.asin(Math.max(-1, Math.min(1, -z))) };
}
