// "Make the film": the job with the settings, its progress, and the way to the finished flock.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { ended, expect } from "../app/jobs.js";
import { say } from "../app/words.js";
import { filmButtons } from "../parts/film-buttons.js";
import { problemBox } from "../parts/problem.js";
import { jobCard } from "../parts/tray.js";
import { bodyOf } from "./settings.js";

/** @param {{libraryId: string, settings: () => import("./settings.js").Settings, life: AbortSignal}} options */
export function maker({ libraryId, settings, life }) {
  const button = element("button.make-film", { type: "button", onclick: make }, say("make.film"));
  const state = element("div.make-state", { "aria-live": "polite" });

  async function make() {
    button.disabled = true;
    try {
      const { job_id, flock_id } = await post("/v1/flocks", { library_id: libraryId, ...bodyOf(settings()) }, life);
      button.disabled = false;
      await expect(job_id);
      follow(job_id, flock_id);
    } catch (problem) {
      button.disabled = false;
      if (!life.aborted) state.replaceChildren(problemBox(problem));
    }
  }

  /** @param {string} jobId @param {string} flockId */
  async function follow(jobId, flockId) {
    /** @type {ReturnType<typeof jobCard> | null} */
    let card = null;
    const place = element("div.make-place");
    state.replaceChildren(place);
    try {
      await ended(jobId, life, (job) => {
        if (!card) place.append(card = jobCard(job), element("p.soft", {}, say("make.wait")));
        card.update(job);
      });
      place.replaceChildren(element("p.done", {}, say("make.done"), " ", element("a.button", { href: `/flocks/${flockId}` }, say("make.open")), ...filmButtons(flockId, { isTold: true })));
    } catch (problem) {
      if (!life.aborted && /** @type {any} */ (problem).name === "AbortError") place.remove();
    }
  }

  return { node: element("div.make-box", {}, button, state) };
}
