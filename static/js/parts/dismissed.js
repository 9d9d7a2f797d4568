// Failed jobs that the person has put away. They stay in the place of all jobs.
// @ts-check
import { signal } from "../app/store.js";

const KEY = "flockreel-dismissed";
/** Ids that are kept: as many as the page keeps jobs. */
const KEPT = 100;

/** Ids of the jobs that were put away, newest first. */
export const dismissed = signal(/** @type {string[]} */ (JSON.parse(localStorage.getItem(KEY) ?? "[]")));

/** @param {string} id */
export const isDismissed = (id) => dismissed.value.includes(id);

/** @param {string} id of a job */
export function dismiss(id) {
  dismissed.set([id, ...dismissed.value].slice(0, KEPT));
  localStorage.setItem(KEY, JSON.stringify(dismissed.value));
}
