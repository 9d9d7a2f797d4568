// All jobs of the person, kept up to date by the event stream, and by polling while the stream is down.
// @ts-check
import { get, post, Problem, remove } from "./api.js";
import { signal } from "./store.js";

const POLL_MS = 1000;
/** Time after which a service that did not answer is asked again, ms. */
const RETRY_MS = 3000;
/** Number of jobs that the page keeps, besides all that are under way. */
const KEPT = 100;

/** The newest jobs, newest first. */
export const jobs = signal(/** @type {Api.Job[]} */ ([]));
/** Whether the service has answered at least once. */
export const ready = signal(false);
/** Waits until the jobs are known. @param {AbortSignal} life @returns {Promise<void>} */
export const whenReady = (life) => new Promise((resolve) => ready.watch((isReady) => { if (isReady) resolve(); }, life));
/** Uploads of this tab, newest first. */
export const uploads = signal(/** @type {import("./upload.js").Upload[]} */ ([]));
let live = false;

/** @param {Api.Job} job */
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

/** Time at which a job was last heard of, ms. An answer to an earlier request knows less. @type {Map<string, number>} */
const heard = new Map();
/** @param {{id: string}} job @param {number} since_ms */
const isHeard = ({ id }, since_ms) => (heard.get(id) ?? -1) >= since_ms;

/** @param {Api.Job[]} all */
function keep(all) {
  // Ids grow with the time at which they were made.
  const sorted = all.sort((a, b) => (a.id < b.id ? 1 : -1));
  jobs.set(sorted.filter((job, k) => k < KEPT || isUnderWay(job)));
}

async function reload() {
  const begun_ms = performance.now();
  const { items } = await get(`/v1/jobs?limit=${KEPT}`);
  const oldest = items.length < KEPT ? "" : items[KEPT - 1].id;
  const others = jobs.value.filter((job) => isHeard(job, begun_ms) || job.id < oldest);
  keep([...items.filter((item) => !isHeard(item, begun_ms)), ...others]);
}

/** @param {import("./job-events.js").Message} message */
function hear(message) {
  const returned = message.live && !live;
  live = message.live;
  // Events may have been missed while the stream was down.
  if (returned) reload().catch(() => {});
  if (message.job) merge(message.job);
}

/** @param {import("./job-events.js").Heard} job */
function merge(job) {
  heard.set(job.id, performance.now());
  const others = jobs.value.filter((other) => other.id !== job.id);
  keep("state" in job ? [job, ...others] : others);
}

/** Adds a job that this page has just started, before the stream tells of it. @param {string} id */
export async function expect(id) {
  const begun_ms = performance.now();
  const job = await get(`/v1/jobs/${id}`);
  if (!isHeard(job, begun_ms)) merge(job);
}

/**
 * Waits until a job has ended.
 * @param {string} id @param {AbortSignal} life @param {(job: Api.Job) => void} [onChange] hears every state
 * @returns {Promise<Api.Job>} the job when it is done; throws a Problem if it failed, an AbortError if it was cancelled or deleted
 */
export function ended(id, life, onChange = () => {}) {
  const waiting = new AbortController();
  const { signal } = waiting;
  return new Promise((resolve, reject) => {
    life.throwIfAborted();
    life.addEventListener("abort", () => reject(life.reason), { signal });
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
    }, AbortSignal.any([life, signal]));
    if (!seen) expect(id).catch(reject);
  }).finally(() => waiting.abort());
}

/** Returns the number of jobs that come before a job that waits, as far as this person sees them. @param {Api.Job} job */
export const aheadOf = (job) => jobs.value.filter((other) => isUnderWay(other) && other.id < job.id).length;

/** @param {string} id */
export const cancel = (id) => remove(`/v1/jobs/${id}`);

/** Starts a failed or cancelled job again. @param {string} id */
export const retry = async (id) => merge(await post(`/v1/jobs/${id}/retry`));

/** Returns the id of the result of a job. @param {Api.Job} job */
export const resultOf = (job) => job.links.result.split("/").at(-1) ?? "";

/** Returns the id of what a job works on; empty for the sample, which works on nothing. @param {Api.Job} job */
export const subjectIdOf = (job) => job.subject?.id ?? "";

/** @type {Record<string, string>} */
const PLACES = { analysis: "/libraries/", views: "/libraries/", flock: "/flocks/", dataset: "/datasets?made=", sample: "/films/" };
/** Returns the address at which the page shows the result of a job. @param {Api.Job} job */
export const addressOf = (job) => (job.kind === "fish" ? `/libraries/${subjectIdOf(job)}/fish?fish=${resultOf(job)}` : PLACES[job.kind] + resultOf(job));
