// The moments at which the measurement is least sure, so that a person can look at them.
// @ts-check
import { SURE } from "./columns.js";

/** Moments that are listed, and least time between two of them, s. */
const MOST = 6;
const APART_S = 0.7;

/**
 * Returns shares of the measured frames, and the weakest moments of different stretches in the order of time.
 * @param {import("./columns.js").Columns} columns @param {{from?: number, to?: number}} [part] measured frames, to exclusive
 * @returns {{shares: Record<"seen" | "head" | "border", number>, moments: {frame: number, why: "lost" | "head" | "place", value: number}[]}}
 */
export function weakest({ n, fps, detected, cut, confidence, head_confidence }, { from = 0, to = n } = {}) {
  let [n_seen, n_sure, n_cut] = [0, 0, 0];
  /** @type {{frame: number, why: "lost" | "head" | "place", value: number}[]} */
  const found = [];
  for (let k = from; k < to; k++) {
    n_seen += detected[k];
    n_cut += cut[k];
    if (detected[k] && head_confidence[k] >= SURE) n_sure += 1;
    if (!detected[k]) { if (k > from && detected[k - 1]) found.push({ frame: k, why: "lost", value: 0 }); continue; }
    if (head_confidence[k] < SURE) found.push({ frame: k, why: "head", value: head_confidence[k] });
    else if (confidence[k] < SURE) found.push({ frame: k, why: "place", value: confidence[k] });
  }
  found.sort((a, b) => a.value - b.value || a.frame - b.frame);
  /** @type {typeof found} */
  const moments = [];
  for (const one of found) {
    if (moments.length < MOST && moments.every((other) => Math.abs(other.frame - one.frame) > APART_S * fps)) moments.push(one);
  }
  const share = (/** @type {number} */ count) => count / Math.max(1, to - from);
  return { shares: { seen: share(n_seen), head: n_sure / Math.max(1, n_seen), border: share(n_cut) }, moments: moments.sort((a, b) => a.frame - b.frame) };
}
