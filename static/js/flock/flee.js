// Play mode: the flock of a plan goes on as boids that flee the pointer. It is a toy: nothing is planned.
// @ts-check
import { appearance, farToNear } from "./appearance.js";
import { N_ROW } from "./flee-flock.js";

/** @typedef {{library: Api.LibraryFile, poses: Api.PosesFile}} Film */

/**
 * Starts from one frame of a plan. Swap the player to `source`, and call `stop` after swapping back.
 * @param {import("./plan.js").Plan} plan @param {number} frame
 * @param {{atlas: import("./atlas.js").Atlas} & Film} film with library.json and poses.json
 * @returns {{source: import("./appearance.js").Source, point: (at: number[] | null) => void, stop: () => void}}
 *   `point` takes the pointer, pixels of the picture; null if it is gone
 */
export function startFlee(plan, frame, { atlas, library, poses }) {
  const worker = new Worker(new URL("flee-worker.js", import.meta.url), { type: "module" });
  let pointer = /** @type {number[] | null} */ (null);
  let isWaiting = true;
  const start = fleeStart(plan, frame, { library, poses });
  // Until the worker answers, the flock stands still.
  let shown = farToNear(start.starts.map((one) => appearance(atlas, one, { ...one, sourceFrame: one.frame }, null)));

  worker.onmessage = ({ data }) => {
    isWaiting = false;
    if (data) shown = appearancesOf(data, atlas);
  };
  worker.postMessage({ start, now: performance.now(), pointer });
  return {
    source: {
      fps: plan.fps, nFrames: Infinity, span: Infinity, isLive: true,
      at() {
        if (!isWaiting) worker.postMessage({ now: performance.now(), pointer });
        isWaiting = true;
        return shown;
      },
    },
    point(at) { pointer = at; },
    stop: () => worker.terminate(),
  };
}

/** Returns what the worker needs to know. @param {import("./plan.js").Plan} plan @param {number} frame @param {Film} film */
export function fleeStart(plan, frame, { library, poses }) {
  const isSide = poses.view !== "top";
  const { params } = plan.head;
  const headings = Float32Array.from(poses.frames, ({ heading_rad }) => heading_rad ?? 0);
  const starts = Array.from({ length: plan.nIndividuals }, (_, i) => {
    const { sourceFrame, mirrored, rotation, x, y, depth, scale } = plan.cell(i, frame);
    const heading = headings[sourceFrame] ?? 0;
    return { x, y, depth, scale, mirrored, rotation, frame: sourceFrame, heading: (mirrored ? Math.PI - heading : heading) + rotation };
  });
  return {
    starts, headings, isSide, playable: library.component, jumps: library.playback, canMirror: isSide && params?.mirror === true,
    sizePx: plan.sizePx, lengthPx: plan.lengthPx, fps: plan.fps, mostTurn: ((params?.matching?.rho_deg ?? 10) * Math.PI) / 180,
    speed: Math.min(3, Math.max(0.4, library.stats?.speed_bl_per_s?.[1] ?? 0.8)),
  };
}

/** @param {Float32Array} rows @param {import("./atlas.js").Atlas} atlas */
function appearancesOf(rows, atlas) {
  const all = [];
  for (let at = 0; at < rows.length; at += N_ROW) {
    const [x, y, depth, ...rest] = rows.subarray(at, at + N_ROW);
    const [main, second] = [rest.slice(0, 4), rest.slice(4, 8)].map(([sourceFrame, mirrored, rotation, scale]) => ({ sourceFrame, mirrored: mirrored > 0, rotation, scale }));
    all.push(appearance(atlas, { x, y, depth }, main, rest[8] > 0 ? { ...second, weight: rest[8] } : null));
  }
  return farToNear(all);
}
