// The frames of play mode: which filmed frame follows, so that the animal heads where its boid does. The cost of
// a frame at a heading is its own error plus that of the best way on, by value iteration over the filmed order
// and the jumps of the library.
// @ts-check
import { wrap } from "./flee-boids.js";

/** Headings for which costs are stored. Even, so that each has its mirror image. */
const N_BINS = 16;
/** Weight of each later frame, cost of a jump and of a dead end (rad), and rounds of the iteration. */
const [LATER, JUMP, DEAD_END, ROUNDS] = [0.93, 0.4, 20, 12];

/** @typedef {{frame: number, mirrored: boolean}} State @typedef {{to: number, flip: boolean, cost: number}} Way */

/**
 * @param {{headings: ArrayLike<number>, playable: number[], jumps: [number, number, number, boolean?][],
 *   canMirror: boolean, isSide: boolean}} film headings in radians by frame; jumps as `playback` of library.json
 */
export function createChooser({ headings, playable, jumps, canMirror, isSide }) {
  const frames = new Set(playable);
  /** @type {Map<number, Way[]>} */
  const ways = new Map(playable.map((frame) => [frame, frames.has(frame + 1) ? [{ to: frame + 1, flip: false, cost: 0 }] : []]));
  for (const [from, to, , flip = false] of jumps) if (frames.has(to) && (canMirror || !flip)) ways.get(from)?.push({ to, flip, cost: JUMP });

  const n = Math.max(...playable) + 1;
  const costs = Array.from({ length: N_BINS }, () => new Float32Array(n));
  const costOf = (/** @type {number} */ bin, /** @type {Way} */ { to, flip, cost }) => cost + costs[flip ? mirrorOf(bin) : bin][to];
  const order = [...playable].sort((a, b) => b - a);
  for (let round = 0; round < ROUNDS; round++) {
    for (let bin = 0; bin < N_BINS; bin++) {
      for (const frame of order) {
        let next = DEAD_END;
        for (const way of ways.get(frame) ?? []) next = Math.min(next, costOf(bin, way));
        // From above, sprites are turned to any heading.
        const error = isSide ? Math.abs(wrap((headings[frame] || 0) - angleOf(bin))) : 0;
        costs[bin][frame] = error + LATER * next;
      }
    }
  }

  return {
    /** Returns the heading of a frame as shown, without rotation. @param {State} state */
    headingOf: ({ frame, mirrored }) => (mirrored ? wrap(Math.PI - (headings[frame] || 0)) : headings[frame] || 0),
    /**
     * Returns the state that follows, and whether it is a jump.
     * @param {State} state @param {number} heading of the boid
     */
    next({ frame, mirrored }, heading) {
      const bin = binOf(mirrored ? Math.PI - heading : heading);
      /** @type {Way | null} */
      let best = null;
      for (const way of ways.get(frame) ?? []) if (!best || costOf(bin, way) < costOf(bin, best)) best = way;
      best ??= { to: order.reduce((a, b) => (costs[bin][b] < costs[bin][a] ? b : a)), flip: false, cost: JUMP };
      return { frame: best.to, mirrored: best.flip !== mirrored, isJump: best.cost > 0 };
    },
  };
}

const angleOf = (/** @type {number} */ bin) => (2 * Math.PI * bin) / N_BINS;
const binOf = (/** @type {number} */ angle) => (((Math.round((angle * N_BINS) / (2 * Math.PI)) % N_BINS) + N_BINS) % N_BINS);
const mirrorOf = (/** @type {number} */ bin) => (N_BINS + N_BINS / 2 - bin) % N_BINS;
