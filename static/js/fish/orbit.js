// A camera that a person turns around a point and moves nearer or farther. It stands where the film's camera was
// until it is turned.
// @ts-check

/** Farthest turn up and down, radians, a little short of straight from above. */
const MOST_PITCH = 1.5;
/** Nearest and farthest zoom. */
const ZOOMS = [0.2, 8];

/** @typedef {{yaw: number, pitch: number, zoom: number}} Turned radians to the right and up, and the zoom */
/** @typedef {ReturnType<typeof createOrbit>} Orbit */

/** @param {Turned} start @param {() => void} onChange */
export function createOrbit(start, onChange) {
  let now = { ...start };
  const set = (/** @type {Turned} */ next) => { now = next; onChange(); };
  return {
    get turned() { return now; },
    turn: (/** @type {number} */ yaw, /** @type {number} */ pitch) => set({ ...now, yaw: now.yaw + yaw, pitch: Math.min(MOST_PITCH, Math.max(-MOST_PITCH, now.pitch + pitch)) }),
    zoom: (/** @type {number} */ by) => set({ ...now, zoom: Math.min(ZOOMS[1], Math.max(ZOOMS[0], now.zoom * by)) }),
    reset: (/** @type {Turned} */ to = start) => { start = to; set({ ...to }); },
  };
}

/**
 * Returns where the camera is, and the matrix that brings space before it.
 * @param {Turned} turned @param {number[]} target the point in the middle @param {number} depth its distance at zoom 1
 */
export function viewOf({ yaw, pitch, zoom }, target, depth) {
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const [right, up, back] = [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  const eye = target.map((value, axis) => value + (back[axis] * depth) / zoom);
  const shift = [right, up, back].map((axis) => -axis.reduce((sum, value, k) => sum + value * eye[k], 0));
  return { eye, view: [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, ...shift, 1] };
}
