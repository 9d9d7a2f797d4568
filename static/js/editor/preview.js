// A preview of the measurement: the service looks at some frames of the film with the settings as they are, and says
// what it would find or why it would refuse the film.
// @ts-check
import { post, Problem } from "../app/api.js";
import { element } from "../app/element.js";
import { signal } from "../app/store.js";
import { count, say } from "../app/words.js";
import { problemBox } from "../parts/problem.js";
import { mendsOf } from "./mends.js";
import { createStrip } from "./seen.js";
import { changesOf } from "./settings.js";

/** Time after a change until the service is asked, ms: a person may go on dragging. */
const REST_MS = 250;

/** @typedef {import("../app/store.js").Signal<Api.Schemas["AnalysisPreview"] | null>} Seen */

/**
 * @param {{footage: Api.Footage, film: import("./film.js").Film, draft: import("./editor.js").Draft, fields: import("./settings.js").Fields,
 *   open: (mend: import("./mends.js").Mend) => void, life: AbortSignal}} options
 */
export function createPreview({ footage, film, draft, fields, open, life }) {
  const seen = /** @type {Seen} */ (signal(null));
  const words = element("p.soft", { role: "status" }, say("editor.seen.looking"));
  const problem = element("div");
  const node = element("section.editor-seen", { "aria-busy": true }, createStrip(film, seen, life), words, problem);
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  let asking = new AbortController();
  const show = (/** @type {Api.Schemas["AnalysisPreview"]} */ { frames, refusal }) => {
    const found = frames.filter((one) => one.animal_px).length;
    words.textContent = frames.length ? say("editor.seen", { found: count(found), of: count(frames.length) }) : "";
    const reason = refusal && new Problem(refusal);
    problem.replaceChildren(...(reason ? [problemBox(reason, mendsOf(reason, open))] : []));
  };
  const ask = async () => {
    const signal = AbortSignal.any([life, asking.signal]);
    try {
      const preview = await post("/v1/analyses/preview", { footage_id: footage.id, params: changesOf(draft.value, fields) }, signal);
      seen.set(preview);
      show(preview);
    } catch (reason) {
      if (signal.aborted) return;
      seen.set(null);
      problem.replaceChildren();
      words.textContent = say("editor.seen.none", { reason: /** @type {Error} */ (reason).message });
    }
    node.setAttribute("aria-busy", "false");
  };
  draft.watch(() => {
    clearTimeout(timer);
    asking.abort();
    asking = new AbortController();
    node.setAttribute("aria-busy", "true");
    timer = setTimeout(ask, REST_MS);
  }, life);
  life.addEventListener("abort", () => clearTimeout(timer));
  return { node, seen };
}
