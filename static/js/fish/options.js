// The options of a virtual fish, read from the schema of the service, and the job that makes one.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { ended, expect, resultOf } from "../app/jobs.js";
import { say } from "../app/words.js";
import { problemBox } from "../parts/problem.js";
import { jobCard } from "../parts/tray.js";
import { control } from "../studio/control.js";
import { loadFields } from "../studio/schema.js";
import { changedFrom, PAPERS, shownAs } from "./settings.js";

/** Names in the order of use; the service may tell more. */
const ORDER = ["body", "palette", "swim", "bank_rad", "smooth_s", "bridge_s", "length_m", "height_m"];

/**
 * @param {{library: Api.Library, params: Api.FishParams | null, life: AbortSignal, onMade: (id: string) => void}} options params: of the fish that is shown, null = none
 */
export async function optionsBox({ library, params, life, onMade }) {
  const fields = new Map([...await loadFields("Fish")].map(([name, field]) => [name, shownAs(field, library)]));
  const names = [...new Set([...ORDER, ...fields.keys()])].filter((name) => fields.has(name) && name !== "preset");
  let settings = changedFrom(params, fields);
  /** @param {Api.FishParams} patch undefined = the default */
  const change = (patch) => {
    settings = changedFrom({ ...settings, ...patch }, fields);
    update();
  };
  const controls = names.map((name) => control(/** @type {import("./settings.js").ShownField} */ (fields.get(name)), { change, fields }));
  const update = () => {
    for (const { name, update: show } of controls) {
      const field = /** @type {import("./settings.js").ShownField} */ (fields.get(name));
      show(/** @type {Record<string, unknown>} */ (settings)[name] ?? field.default, { isSet: name in settings, perUnit: field.perUnit });
    }
  };
  const papers = element("button.quiet", { type: "button", onclick: () => change(PAPERS) }, say("fish.papers"));
  const { button, state } = maker({ libraryId: library.id, settings: () => settings, life, onMade, isFirst: !params });
  update();
  return element("section.fish-options", {}, element("h2", {}, say("fish.options")), element("div.settings", {}, ...controls.map(({ node }) => node)),
    element("p.actions", {}, button, papers), element("p.soft", {}, say("fish.papers.help")), state);
}

/**
 * Returns the button that makes a virtual fish, and where its progress is shown.
 * @param {{libraryId: string, settings: () => Api.FishParams, life: AbortSignal, onMade: (id: string) => void, isFirst?: boolean}} options
 */
export function maker({ libraryId, settings, life, onMade, isFirst = false }) {
  const button = element("button.make-fish", { type: "button", onclick: () => make() }, say(isFirst ? "fish.make" : "fish.make.other"));
  const state = element("div.make-state", { "aria-live": "polite" });

  /** @param {Api.FishParams} [patch] changes of the settings */
  async function make(patch) {
    button.disabled = true;
    try {
      const { job_id } = await post("/v1/fish", { library_id: libraryId, ...settings(), ...patch }, life);
      await expect(job_id);
      await follow(job_id);
    } catch (problem) {
      if (life.aborted) return;
      if (/** @type {any} */ (problem).name === "AbortError") state.replaceChildren();
      else state.replaceChildren(problemBox(problem, mendsOf(problem)));
      button.focus();
    }
    button.disabled = false;
  }

  /** The goldfish needs no picture of the animal. @param {unknown} problem */
  const mendsOf = (problem) => (/** @type {any} */ (problem).code === "animal_too_small" ? [{ label: say("fish.goldfish"), act: () => void make({ body: "goldfish" }) }] : []);

  /** Shows a job until it has ended. @param {string} jobId */
  async function follow(jobId) {
    /** @type {ReturnType<typeof jobCard> | null} */
    let card = null;
    const done = await ended(jobId, life, (job) => {
      if (!card) state.replaceChildren(card = jobCard(job));
      card.update(job);
    });
    onMade(resultOf(done));
  }
  return { button, state, follow };
}
