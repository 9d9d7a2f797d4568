// One job on the page: what it does, how far it is, a way to stop it; when it failed, why.
// @ts-check
import { cancelJob, Problem } from "./api.js";
import { element, showProblem } from "./element.js";
import { followJob } from "./follow-job.js";
import { stageOf } from "./words.js";

/** A card with a bar. @param {Element} place @param {() => void} onCancel */
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
 * @returns {Promise<boolean>} true when it is done
 */
export async function showJob(place, id) {
  // A card of its own: when another has taken the place meanwhile, this one ends unseen.
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

const attemptNote = (job) => (job.attempt > 1 ? `Begun again after an interruption (attempt ${job.attempt}).` : "");
