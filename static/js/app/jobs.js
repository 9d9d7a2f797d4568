// All jobs of the person, kept up to date by the event stream, and by polling while the stream is down.
// @ts-check
import { get, post, Problem, remove } from "./api.js";
import { signal } from "./store.js";

const POLL_MS = 1000;
/** Time after which a service that did not answer is asked again, ms. */
const RETRY_MS = 3000;
/** Number of jobs that the page keeps. */
const KEPT = 100;

/** The newest jobs, newest first. @type {import("./store.js").Signal<any[]>} */
export const jobs = signal(/** @type {any[]} */ ([]));
/** Whether the service has answered at least once. */
export const ready = signal(false);
/** Uploads of this tab, newest first. @type {import("./store.js").Signal<import("./upload.js").Upload[]>} */
export const uploads = signal(/** @type {any[]} */ ([]));
let live = false;

/** @param {any} job */
export const isUnderWay = (job) => job.state === "queued" || job.state === "running";

/** Time after which the event stream opens, ms: the flock of Home comes first. Until then, the page polls. */
const STREAM_MS = 1500;

/** Loads the jobs and opens the event stream for as long as the page is open. */
export async function startJobs() {
  try {
    await reload();
  } catch (problem) {
    // A person who signs in loads the page again.
    if (/** @type {any} */ (problem).status !== 401) setTimeout(startJobs, RETRY_MS);
    return;
  }
  ready.set(true);
  setTimeout(listen, STREAM_MS);
  setInterval(() => { if (!live && jobs.value.some(isUnderWay)) reload().catch(() => {}); }, POLL_MS);
}

function listen() {
  if (globalThis.SharedWorker) {
    const { port } = new SharedWorker("/static/js/app/job-worker.js", { type: "module" });
    port.onmessage = ({ data }) => hear(data);
    port.postMessage({ listening: true });
    addEventListener("pagehide", () => port.postMessage({ listening: false }));
    addEventListener("pageshow", (event) => { if (event.persisted) port.postMessage({ listening: true }); });
  } else import("./job-events.js").then(({ openEvents }) => openEvents(hear));
}

const reload = async () => jobs.set((await get(`/v1/jobs?limit=${KEPT}`)).items);

/** @param {{job?: any, live: boolean}} message */
function hear(message) {
  const returned = message.live && !live;
  live = message.live;
  // Events may have been missed while the stream was down.
  if (returned) reload().catch(() => {});
  if (message.job) merge(message.job);
}

/** @param {any} job with only its id if it was deleted */
function merge(job) {
  const others = jobs.value.filter((other) => other.id !== job.id);
  if (!job.state) return jobs.set(others);
  const all = [job, ...others].sort((a, b) => (a.created_at < b.created_at ? 1 : -1));
  jobs.set(all.slice(0, KEPT));
}

/** Adds a job that this page has just started, before the stream tells of it. @param {string} id */
export async function expect(id) {
  merge(await get(`/v1/jobs/${id}`));
}

/**
 * Waits until a job has ended.
 * @param {string} id @param {AbortSignal} life @param {(job: any) => void} [onChange] hears every state
 * @returns {Promise<any>} the job when it is done; throws a Problem if it failed, an AbortError if it was cancelled or deleted
 */
export function ended(id, life, onChange = () => {}) {
  return new Promise((resolve, reject) => {
    life.addEventListener("abort", () => reject(new DOMException("left", "AbortError")));
    let seen = false;
    jobs.watch((all) => {
      const job = all.find((one) => one.id === id);
      if (!job) return seen && reject(new DOMException("deleted", "AbortError"));
      seen = true;
      onChange(job);
      if (job.state === "done") resolve(job);
      if (job.state === "failed") reject(new Problem(job.error ?? {}));
      if (job.state === "cancelled") reject(new DOMException("cancelled", "AbortError"));
      return undefined;
    }, life);
    if (!seen) expect(id).catch(reject);
  });
}

/** @param {string} id */
export const cancel = (id) => remove(`/v1/jobs/${id}`);

/** Starts a failed or cancelled job again. @param {string} id */
export const retry = async (id) => merge(await post(`/v1/jobs/${id}/retry`));

/** Returns the id of the result of a job. @param {any} job @returns {string} */
export const resultOf = (job) => job.links.result.split("/").at(-1);

const PLACES = { analysis: "/libraries/", flock: "/flocks/", sample: "/films/" };
/** Returns the address at which the page shows the result of a job. @param {any} job */
export const addressOf = (job) => (job.kind === "fish" ? `/libraries/${job.subject?.id}/fish?fish=${resultOf(job)}` : /** @type {any} */ (PLACES)[job.kind] + resultOf(job));
