// "Measure again": a dialog that changes settings of the measurement, by fields and by pointing at the picture,
// and starts an analysis. Its result is shown beside the numbers before.
// @ts-check
import { get, post } from "../app/api.js";
import { element } from "../app/element.js";
import { ended } from "../app/jobs.js";
import { signal } from "../app/store.js";
import { count, say } from "../app/words.js";
import { mendsOf } from "../parts/mend.js";
import { problemBox, showProblem } from "../parts/problem.js";
import { jobCard } from "../parts/tray.js";
import { analysisDefaults } from "../studio/schema.js";
import { choice, part, slide } from "./remeasure-fields.js";
import { changedParams } from "./remeasure-params.js";
import { createPicture } from "./remeasure-picture.js";
import { comparison, settingName } from "./numbers.js";

/** @type {import("./remeasure-picture.js").Tool[]} */
const TOOLS = ["animal", "head", "ignore"];

/**
 * Opens the dialog. @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, results: HTMLElement, tool?: string, params?: Api.AnalysisChanges}} options
 */
export async function openRemeasure(desk, { player, results, tool: first = "animal", params = {} }) {
  const { library } = desk;
  player.pause();
  const closing = new AbortController();
  const life = closing.signal;
  const defaults = await analysisDefaults();
  if (desk.life.aborted || document.querySelector("dialog.remeasure")) return;
  const former = /** @type {Api.AnalysisParams} */ ({ ...defaults, ...library.params });
  const draft = signal({ ...former, ...params, ignore: params.ignore ?? former.ignore ?? [] });
  const tool = signal(TOOLS.find((one) => one === first) ?? "animal");
  const picture = createPicture(desk, { video: player.video, isBroken: player.isBroken.value, tool, draft, life });

  const radios = TOOLS.map((name) => element("label.choice", {}, element("input", { type: "radio", name: "remeasure-tool", value: name, checked: name === tool.value, onchange: () => tool.set(name) }), element("span", {}, say(`remeasure.tool.${name}`))));
  const help = element("p.soft");
  tool.watch((now) => { help.textContent = say(`remeasure.tool.${now}.help`); }, life);
  const frame = element("input", { type: "range", min: desk.first, max: desk.last(), step: 1, "aria-label": say("desk.frame"), oninput: () => desk.goTo(frame.valueAsNumber) });
  desk.moment.watch((now) => { frame.value = String(now); }, life);

  let preset = /** @type {"" | "papers"} */ ("");
  const presets = element("select", { name: "preset", onchange: () => { preset = presets.value === "papers" ? "papers" : ""; tell(); } }, ...["", "papers"].map((name) => element("option", { value: name }, say(`remeasure.preset.${name || "none"}`))));
  const marks = element("ul.remeasure-marks");
  const sent = element("p.soft", { role: "status" });
  const problem = element("div");
  const start = element("button", { type: "submit" }, say("remeasure.start"));
  const changes = () => changedParams({ draft: draft.value, former, defaults, preset });
  const tell = () => {
    marks.replaceChildren(...marksOf(draft));
    const names = [...(preset ? ["preset"] : []), .../** @type {(keyof Api.AnalysisChanges)[]} */ (Object.keys(changes())).filter((name) => name !== "preset" && JSON.stringify(draft.value[name]) !== JSON.stringify(former[name]))];
    sent.textContent = names.length ? say("remeasure.sends", { names: names.map(settingName).join(", ") }) : say("remeasure.sends_none");
  };
  draft.watch(tell, life);

  const form = element("form", { method: "dialog" },
    element("header.place-head", {}, element("h2", {}, say("remeasure.title")), element("button.quiet", { type: "button", onclick: () => dialog.close() }, say("cancel"))),
    element("div.remeasure-columns", {},
      element("div.remeasure-left", {}, element("fieldset.choices", {}, element("legend.unseen", {}, say("remeasure.tools")), ...radios), help, element("div.remeasure-box", {}, picture), frame, marks),
      element("div.remeasure-right", {}, choice(draft, "view", [null, "side", "top"]), choice(draft, "follow", ["one", "largest"]), slide(draft, "threshold", { min: 1, max: 100, step: 1 }), part(draft, desk), slide(draft, "kappa", { min: 1, max: 6, step: 0.5 }), choice(draft, "sprites", ["auto", "always"]),
        element("label.field", {}, say("remeasure.preset"), presets, element("small", {}, say("remeasure.preset.help"))))),
    element("footer.remeasure-foot", {}, sent, problem, start));
  const dialog = element("dialog.remeasure", { "aria-label": say("remeasure.title") }, form);
  dialog.addEventListener("close", () => { closing.abort(); dialog.remove(); });
  form.addEventListener("submit", async (/** @type {Event} */ event) => {
    event.preventDefault();
    start.disabled = true;
    try {
      const params = changes();
      const begun = await post("/v1/analyses", { footage_id: library.footage_id, params });
      dialog.close();
      await follow(desk, { begun, params, results, player });
    } catch (reason) {
      showProblem(problem, reason);
      start.disabled = false;
    }
  });
  document.body.append(dialog);
  desk.life.addEventListener("abort", () => dialog.close());
  dialog.showModal();
  if (first === "part") /** @type {HTMLElement} */ (form.elements.namedItem("from_s")).focus();
}

/**
 * Shows an analysis while it runs, and its numbers beside the former ones. @param {import("./instrument.js").Instrument} desk
 * @param {{begun: Api.Schemas["AnalysisAccepted"], params: Api.AnalysisChanges, results: HTMLElement, player: import("./player.js").Player}} measurement
 */
async function follow(desk, { begun: { job_id: jobId, library_id: libraryId }, params, results, player }) {
  const card = jobCard({ kind: "analysis" });
  results.replaceChildren(element("h2", {}, say("remeasure.title")), card);
  results.scrollIntoView({ block: "center" });
  try {
    await ended(jobId, desk.life, card.update);
    const library = await get(`/v1/libraries/${libraryId}`, desk.life);
    const link = element("a.button", { href: `/libraries/${libraryId}?compare=${desk.library.id}` }, say("remeasure.open"));
    results.replaceChildren(element("h2", {}, say("desk.compare.title")), comparison({ library: desk.library }, { library }), element("p.actions", {}, link));
  } catch (reason) {
    if (desk.life.aborted) return;
    if (/** @type {any} */ (reason).name === "AbortError") results.replaceChildren();
    else {
      const mends = mendsOf(reason, (mend) => openRemeasure(desk, { player, results, params: { ...params, ...mend } }));
      const again = { label: say("remeasure.again"), act: () => openRemeasure(desk, { player, results, params }) };
      results.replaceChildren(problemBox(reason, [...mends, again]));
    }
  }
}

/** Returns the list of what was drawn, each with a button that removes it. @param {import("./remeasure-fields.js").Draft} draft */
function marksOf(draft) {
  const { animal_at, head, ignore, camera, animal } = draft.value;
  const row = (/** @type {string} */ text, /** @type {Partial<typeof draft.value>} */ without) => element("li", {}, element("span", {}, text), element("button.quiet", { type: "button", "aria-label": say("remeasure.remove_one", { what: text }), onclick: () => draft.set({ ...draft.value, ...without }) }, say("remeasure.remove")));
  const at = (/** @type {number[]} */ point) => point.map(Math.round).join(", ");
  return [
    ...(animal_at ? [row(say("remeasure.mark.animal", { at: at(animal_at.at_px), frame: String(animal_at.frame) }), { animal_at: null })] : []),
    ...(head ? [row(say("remeasure.mark.head", { at: at(head.point), frame: String(head.frame) }), { head: null })] : []),
    ...ignore.map((one, k) => row(say("remeasure.mark.ignore", { size: `${one.box_px[2]} × ${one.box_px[3]}` }), { ignore: ignore.filter((_, idx) => idx !== k) })),
    ...(camera && animal ? [row(say("remeasure.mark.size", { cm: count(100 * animal.length_m) }), { camera: null, animal: null })] : []),
  ];
}
