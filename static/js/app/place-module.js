// The module of a place, also when the service was away while it was asked for.
// @ts-check
import { unreachable } from "./api.js";

/** Key of the time at which the page was loaded again for want of a module. */
const RELOADED = "flockreel-reloaded";
/** Shortest time between two such loads. A module that is broken must not load the page for ever. */
const PAUSE_MS = 10_000;

/**
 * Loads the module of a place.
 * @param {string} name @param {AbortSignal} life that of the place
 * @param {(problem: import("./api.js").Problem) => void} tell called if the service is away @returns {Promise<import("./router.js").Place>}
 */
export async function placeModule(name, life, tell) {
  try {
    return await import(`../places/${name}.js`);
  } catch (problem) {
    if (Date.now() - Number(sessionStorage.getItem(RELOADED)) < PAUSE_MS) throw problem;
    tell(unreachable());
    while (!life.aborted && !(await isThere())) await new Promise((resolve) => { setTimeout(resolve, 1000); });
    if (life.aborted) throw problem;
    // Browsers remember that a module could not be loaded, and do not ask for it again.
    sessionStorage.setItem(RELOADED, String(Date.now()));
    location.reload();
    return new Promise(() => {});
  }
}

/** Whether the service answers. */
const isThere = () => fetch("/healthz").then(({ ok }) => ok, () => false);
