// Names of films, for jobs and flocks that only know an id, and the state of their videos.
// @ts-check
import { get, list } from "./api.js";
import { expect, isUnderWay, jobs, resultOf, subjectIdOf } from "./jobs.js";
import { say } from "./words.js";

/** @type {Map<string, Promise<Api.Things[keyof Api.Things]>>} */
const known = new Map();

/**
 * Returns a footage, library or flock; asks the service once.
 * @template {keyof Api.Things} K @param {K} kind @param {string} id @returns {Promise<Api.Things[K]>}
 */
export function thing(kind, id) {
  const path = /** @type {`/v1/${keyof Api.Things}/${string}`} */ (`/v1/${kind}/${id}`);
  if (!known.has(path)) {
    const asked = get(path);
    asked.catch(() => known.delete(path));
    known.set(path, asked);
  }
  return /** @type {Promise<Api.Things[K]>} */ (known.get(path));
}

/** Forgets a thing that was deleted. @param {string} path */
export const forget = (path) => known.delete(path);

/** Keeps the things of a list, so that they need not be asked for one by one. @param {keyof Api.Things} kind @param {Api.Things[keyof Api.Things][]} items */
export function remember(kind, items) {
  for (const item of items) known.set(`/v1/${kind}/${item.id}`, Promise.resolve(item));
}

/** Returns the name of a film as a person would write it, or "film". @param {{name: string, sample: boolean} | null} one */
export function filmName(one) {
  if (one?.sample) return say("film.sample");
  return (one?.name || "").replace(/\.[a-z0-9]{2,5}$/i, "").replaceAll("_", " ").trim() || say("film.unnamed");
}

/** Lists of the last moment, by kind. @type {Map<string, Promise<{items: (Api.Footage | Api.Library)[], next: string | null}>>} */
const listing = new Map();

/**
 * Returns a thing that may be deleted: the list of its kind tells whether it exists, so that nothing missing
 * is asked for. Fails if the service does not answer.
 * @template {"footage" | "libraries"} K @param {K} kind @param {string} id @returns {Promise<Api.Things[K] | null>} null if it is gone
 */
async function existing(kind, id) {
  const path = `/v1/${kind}/${id}`;
  if (!known.has(path)) {
    const asked = listing.get(kind) ?? list(/** @type {`/v1/${"footage" | "libraries"}?${string}`} */ (`/v1/${kind}?limit=100`)).then((page) => { remember(kind, page.items); return page; });
    listing.set(kind, asked);
    const { items: [newest], next } = await asked.finally(() => setTimeout(() => listing.delete(kind), 1000));
    // Ids grow with time: the list does not know what is younger.
    const isYounger = !newest || id > newest.id;
    if (!known.has(path) && !next && !isYounger) return null;
  }
  return thing(kind, id).catch((problem) => {
    if (problem.status === 404) return null;
    throw problem;
  });
}

/**
 * Returns the film that a job works on: its name, the address of a picture if there is one, and
 * whether it was deleted or never made. Fails if the service does not answer.
 * @param {Api.Job} job @returns {Promise<{name: string, poster: string, isGone: boolean}>}
 */
export async function subjectOf(job) {
  if (!job.subject) return { name: say("film.sample"), poster: "", isGone: false };
  // What a job works on does not exist before the job that makes it is done.
  const maker = jobs.value.find((other) => other.id !== job.id && resultOf(other) === subjectIdOf(job));
  if (maker && maker.state !== "done") return { name: (await subjectOf(maker)).name, poster: "", isGone: true };
  const kind = job.subject.kind === "footage" ? "footage" : "libraries";
  const one = await existing(kind, subjectIdOf(job));
  const libraryId = kind === "libraries" ? subjectIdOf(job) : job.kind === "analysis" && job.state === "done" && (await existing("libraries", resultOf(job)))?.id;
  return { name: one ? filmName(one) : say("film.deleted"), poster: one && libraryId ? `/v1/libraries/${libraryId}/poster.jpg` : "", isGone: !one };
}

/** Returns the library of a flock, null if it was deleted. Fails if the service does not answer. @param {Api.Flock} flock */
export const libraryOf = (flock) => existing("libraries", flock.library_id);

// The views of a library: film.mp4 and overlay.mp4, which a job makes after the library.

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
