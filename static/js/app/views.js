// The views of a library: film.mp4 and overlay.mp4, which a job makes after the library.
// @ts-check
import { expect, isUnderWay, jobs } from "./jobs.js";

/** Names of the files. */
export const VIEWS = ["film.mp4", "overlay.mp4"];

/** @typedef {Api.Library["views"]["state"]} State `making`, `done` or `failed` */

/** Returns the state of the views of a library, as far as it is known. @param {Api.Library} library @returns {State} */
export function viewsState({ views }) {
  const job = views.state === "done" ? null : jobs.value.find(({ id }) => id === views.job_id);
  if (!job) return views.state;
  return isUnderWay(job) ? "making" : job.state === "done" ? "done" : "failed";
}

/**
 * Tells the state of the views of a library at once and after each change, until they are done.
 * @param {Api.Library} library @param {AbortSignal} life @param {(state: State) => void} tell
 */
export function watchViews(library, life, tell) {
  const over = new AbortController();
  let told = "";
  const hear = () => {
    const state = viewsState(library);
    if (state === told) return;
    told = state;
    if (state === "done") over.abort();
    tell(state);
  };
  hear();
  if (told === "done" || !library.views.job_id) return;
  jobs.watch(hear, AbortSignal.any([life, over.signal]));
  // The library may be older than the last event of the job.
  expect(library.views.job_id).catch(() => {});
}
