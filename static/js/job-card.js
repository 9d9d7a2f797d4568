// The card of a job: stage, progress and a cancel button; after a failure, the reason.
// @ts-check
import { cancelJob, Problem } from "./api.js";
import { element, showProblem } from "./element.js";
import { followJob } from "./follow-job.js";
import { stageOf } from "./words.js";

/**
 * Shows a card with a progress bar and returns the function that updates it.
 * @param {Element} place @param {() => void} onCancel
 */
export function progressCard(place, onCancel) {
  const stage = element("strong", { role: "status" });
  const share = element("span");
  const bar = element("progress", { max: 1, "aria-label": "Progress" });
  const note = element("small", { hidden: true });
  const cancel = element("button", { type: "button", className: "quiet" }, "Cancel");
  cancel.addEventListener("click", () => { cancel.disabled = true; onCancel(); });
  place.replaceChildren(element("div", { className: "job" }, element("div", { className: "job-line" }, stage, share), bar, note, cancel));
  return (text, progress, more = "") => {
    if (stage.textContent !== text) stage.textContent = text;
    bar.value = progress;
    share.textContent = `${Math.floor(100 * progress)} %`;
    note.textContent = more;
    note.hidden = !more;
  };
}

/**
 * Shows a job until it ends. @param {Element} place @param {string} id
 * @returns {Promise<boolean>} true if it is done, false if it failed or was cancelled
 */
export async function showJob(place, id) {
  // The card has its own element: if another job takes the place, this card is detached.
  const own = element("div");
  place.replaceChildren(own);
  const update = progressCard(own, () => cancelJob(id).catch((problem) => showProblem(own, problem)));
  try {
    const job = await followJob(id, (seen) => update(stageOf(seen), seen.progress ?? 0, attemptNote(seen)));
    if (job.state === "failed") throw new Problem(job.error ?? {});
    own.remove();
    return job.state === "done";
  } catch (problem) {
    showProblem(own, problem);
    return false;
  }
}

const attemptNote = (job) => (job.attempt > 1 ? `Restarted after an interruption (attempt ${job.attempt}).` : "");
