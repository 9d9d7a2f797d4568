// The form for a flock: number of individuals, number of frames, seed and preset.
// @ts-check
import { createFlock } from "./api.js";
import { byId, showProblem } from "./element.js";
import { showJob } from "./job-card.js";
import { count, seconds } from "./words.js";

/** @param {(flockId: string) => void} onFlock */
export function flockForm(onFlock) {
  const form = byId("flock-form");
  const { frames, seed } = form.elements;
  let library = { id: "", fps: 30 };

  const showTime = () => {
    byId("frames-time").textContent = frames.value > 0 ? `${seconds(frames.value / library.fps)} at ${count(library.fps)} frames a second.` : "";
  };
  frames.addEventListener("input", showTime);
  byId("another-seed").addEventListener("click", () => { seed.value = String(Math.floor(Math.random() * 1e6)); });

  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const button = byId("make-button");
    const place = byId("flock-job");
    button.disabled = true;
    try {
      const { job_id, flock_id } = await createFlock(wishesOf(form, library.id));
      if (await showJob(place, job_id)) onFlock(flock_id);
    } catch (problem) {
      showProblem(place, problem);
    } finally {
      button.disabled = false;
    }
  });

  /** Sets the library of the next flock. */
  return ({ id, fps, name }) => {
    library = { id, fps };
    byId("make-of").textContent = name ? `Of “${name}”` : "Of the film below";
    byId("make").hidden = false;
    showTime();
  };
}

function wishesOf(form, libraryId) {
  const { count: individuals, frames, seed, preset } = form.elements;
  const wishes = { library_id: libraryId, count: individuals.value ? individuals.valueAsNumber : null, frames: frames.valueAsNumber, seed: seed.valueAsNumber };
  return preset.value ? { ...wishes, preset: preset.value } : wishes;
}
