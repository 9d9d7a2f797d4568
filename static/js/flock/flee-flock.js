// A flock of play mode: boids, each with the frame that shows it. Runs in a worker.
// @ts-check
import { stepBoids, wrap } from "./flee-boids.js";
import { createChooser } from "./flee-frames.js";

/** Frames in which the former frames fade out after a jump. */
const FADE_FRAMES = 4;
/** Numbers of a row: x, y, depth, then a look, then the look that fades out and its weight. */
export const N_ROW = 12;

/**
 * @typedef {{x: number, y: number, depth: number, heading: number, scale: number, frame: number, mirrored: boolean}} Start
 * @typedef {Parameters<typeof createChooser>[0] & {starts: Start[], sizePx: number[], lengthPx: number, fps: number,
 *   speed: number, mostTurn: number}} FleeStart positions in pixels; usual speed, BL/s; largest rotation in side view
 * @typedef {{frame: number, mirrored: boolean, rotation: number, age: number}} Former the look that fades out, and the frames since
 * @typedef {{state: import("./flee-frames.js").State, rotation: number, former: Former | null}} Look
 */

/** @param {FleeStart} start */
export function createFlee(start) {
  const { starts, sizePx, lengthPx, fps, speed, isSide, mostTurn } = start;
  const chooser = createChooser(start);
  const tank = { width: sizePx[0] / lengthPx, height: sizePx[1] / lengthPx, speed, isSide };
  const boids = starts.map(({ x, y, depth, heading }, k) => ({ x: x / lengthPx, y: y / lengthPx, depth: depth / lengthPx, heading, speed, fear: 0, phase: 2.4 * k }));
  /** @type {Look[]} */
  const looks = starts.map(({ frame, mirrored, heading }) => ({ state: { frame, mirrored }, rotation: wanted({ frame, mirrored }, heading), former: null }));

  /** Returns the rotation that shows a frame at a heading: in side view within a limit. @param {import("./flee-frames.js").State} state @param {number} heading */
  function wanted(state, heading) {
    const gap = wrap(heading - chooser.headingOf(state));
    return isSide ? Math.max(-mostTurn, Math.min(mostTurn, gap)) : gap;
  }

  /** @param {Look} look @param {number} heading */
  function show(look, heading) {
    const { isJump, ...next } = chooser.next(look.state, heading);
    const { former } = look;
    if (isJump) look.former = { ...look.state, rotation: look.rotation, age: 0 };
    else if (former && ++former.age >= FADE_FRAMES - 1) look.former = null;
    else if (former) former.frame++;
    look.state = next;
    const gap = wrap(wanted(next, heading) - look.rotation);
    look.rotation = isJump || !isSide ? wanted(next, heading) : look.rotation + 0.25 * gap;
  }

  return {
    /** Plays one frame. @param {number[] | null} pointer pixels of the picture */
    step(pointer) {
      stepBoids(boids, tank, 1 / fps, pointer && pointer.map((px) => px / lengthPx));
      for (const [k, look] of looks.entries()) show(look, boids[k].heading);
    },
    /** Returns the flock as rows of N_ROW numbers. */
    rows() {
      const rows = new Float32Array(boids.length * N_ROW);
      for (const [k, { x, y, depth }] of boids.entries()) {
        const { state, rotation, former } = looks[k];
        const old = former ?? { ...state, rotation };
        rows.set([x * lengthPx, y * lengthPx, depth * lengthPx, state.frame, Number(state.mirrored), rotation, starts[k].scale,
          old.frame, Number(old.mirrored), old.rotation, starts[k].scale, former ? 1 - (former.age + 1) / FADE_FRAMES : 0], k * N_ROW);
      }
      return rows;
    },
  };
}
