// Estimate of a job's remaining time, from the speed of its current stage. Within a stage the estimate never rises.
// While the speed is unknown there is no estimate.
// @ts-check
import { COMPUTED } from "../app/words.js";

/** Time of a stage after which its speed is known, s. */
const KNOWN_S = 5;
/** An estimate above this multiple of the time shown last means that the speed is unknown. */
const DOUBTFUL = 1.5;

/** Returns a function that estimates the time left, s, or null. Times are in ms. */
export function timeLeft() {
  let [stage, from, from_ms, end_ms] = ["", 0, 0, Infinity];
  return (/** @type {Pick<Api.Job, "stage" | "progress">} */ job, /** @type {number} */ now_ms) => {
    if (job.stage !== stage) [stage, from, from_ms, end_ms] = [job.stage ?? "", job.progress, now_ms, Infinity];
    const spent_ms = now_ms - from_ms;
    if (spent_ms < KNOWN_S * 1000 || job.progress <= from || job.progress >= COMPUTED) return null;
    const left_ms = (spent_ms * (1 - job.progress)) / (job.progress - from);
    const told_ms = end_ms - now_ms;
    if (left_ms > DOUBTFUL * told_ms) return null;
    end_ms = Math.min(end_ms, now_ms + left_ms);
    return Math.max(1, (end_ms - now_ms) / 1000);
  };
}
