// The editor of a measurement: the film with an axis of time, on which a person points and draws, and all settings.
// A sentence says what will be measured. It opens over every film, whether measured, refused or new.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { styled } from "../app/router.js";
import { signal } from "../app/store.js";
import { say, seconds } from "../app/words.js";
import { settingName, settingWords } from "../desk/numbers.js";
import { showProblem } from "../parts/problem.js";
import { loadFields } from "../studio/schema.js";
import { createFilm } from "./film.js";
import { fileFields, withFiles } from "./files.js";
import { settingsForm } from "./form.js";
import { marksList } from "./marks.js";
import { partField, partOf } from "./part.js";
import { createPicture } from "./picture.js";
import { createPreview } from "./preview.js";
import { nearest } from "./seen.js";
import { changed, changesOf, settingsOf } from "./settings.js";

/**
 * @typedef {import("../app/store.js").Signal<import("./settings.js").Settings>} Draft the settings that the person may change
 * @typedef {{film: Api.Footage, library?: Api.Library, former?: Record<string, any>, patch?: Record<string, any>, proposed?: number[][], focus?: string, frame?: number, life: AbortSignal,
 *   onBegun: (begun: Api.Schemas["AnalysisAccepted"], params: Api.AnalysisChanges) => void}} Opening
 *   library: a measurement of the film; former: the parameters of the last measurement; patch: what is changed at once;
 *   proposed: boxes that may be ignored; focus: the parameter whose control gets the focus
 */

/** @type {import("./picture.js").Tool[]} */
const TOOLS = ["animal", "head", "ignore"];
/** Tools by the parameter that they set. */
const TOOL_OF = /** @type {Record<string, import("./picture.js").Tool>} */ ({ animal_at: "animal", head: "head", ignore: "ignore" });
/** Style sheets of the editor, in the order of the cascade. */
const STYLES = ["form", "studio", "desk", "editor"];

/**
 * Returns how a mend opens the editor: what it changes, and where it leads. @param {import("./mends.js").Mend} mend @param {import("../app/api.js").Problem} problem
 */
export function openedBy({ param, value }, problem) {
  const known = /** @type {any} */ (value);
  const proposed = problem.mends.flatMap((mend) => (mend.param === "ignore" && /** @type {any} */ (mend.value)?.at(-1)?.box_px ? [/** @type {any} */ (mend.value).at(-1).box_px] : []));
  return { former: problem.params ?? {}, patch: known === null ? {} : { [param]: known }, proposed, focus: param, frame: known?.frame ?? problem.params?.animal_at?.frame ?? 0 };
}

/** Opens the editor. @param {Opening} opening */
export async function openEditor({ film: footage, library, former = {}, patch = {}, proposed = [], focus = "animal_at", frame = 0, life: place, onBegun }) {
  const [fields] = await Promise.all([loadFields("Analysis"), ...STYLES.map((sheet) => styled(`/static/css/${sheet}.css`))]);
  if (place.aborted || document.querySelector("dialog.editor")) return;
  const closing = new AbortController();
  const life = AbortSignal.any([place, closing.signal]);
  const film = createFilm(footage, { library, frame, life });
  /** @type {Draft} */
  const draft = signal(settingsOf({ ...former, ...patch }, fields));
  const tool = signal(TOOL_OF[focus] ?? "animal");
  const files = signal(/** @type {Record<string, File | null>} */ ({}));
  const open = (/** @type {import("./mends.js").Mend} */ { param, value }) => {
    if (value !== null) draft.set({ ...draft.value, [param]: value });
    tool.set(TOOL_OF[param] ?? tool.value);
    focusOn(dialog, param);
  };
  const { node: preview, seen } = createPreview({ footage, film, draft, fields, open, life });
  // Outlines are known for the frames of the preview only. A frame in which a point was set stays.
  const goToSeen = () => {
    const { animal_at, head } = draft.value;
    if ([animal_at, head].some((point) => point?.frame === film.moment.value)) return;
    film.goTo(nearest(seen.value, film.moment.value)?.frame ?? film.moment.value);
  };
  seen.watch(goToSeen, life);
  const picture = createPicture(film, { tool, draft, seen, proposed, life });

  const radios = TOOLS.map((name) => element("label.choice", {}, element("input", { type: "radio", name: "editor-tool", value: name, onchange: () => tool.set(name) }), element("span", {}, say(`editor.tool.${name}`))));
  const help = element("p.soft");
  const showTool = () => {
    // Without the film, nobody knows which frame the picture shows.
    const isStill = film.isBroken.value;
    if (isStill && tool.value !== "ignore") tool.set("ignore");
    for (const label of radios) {
      const input = /** @type {HTMLInputElement} */ (label.firstElementChild);
      [input.checked, input.disabled] = [input.value === tool.value, isStill && input.value !== "ignore"];
    }
    help.textContent = [isStill ? say("editor.still") : "", say(`editor.tool.${tool.value}.help`)].join(" ");
  };
  tool.watch(showTool, life);
  film.isBroken.watch(showTool, life);
  const time = element("output");
  const axis = element("input", { type: "range", name: "frame", min: 0, max: film.last, step: 1, "aria-label": say("desk.frame"), oninput: () => film.goTo(axis.valueAsNumber), onchange: goToSeen });
  film.moment.watch((now) => { axis.value = String(now); time.textContent = say("editor.moment", { time: seconds(now / footage.fps), frame: String(now) }); }, life);

  const form = settingsForm({ fields, draft, life });
  const marks = marksList({ draft, proposed, life });
  const sentence = element("p", { role: "status" });
  const tell = () => { sentence.textContent = sentenceOf({ settings: draft.value, files: files.value, fields, end_s: film.end_s }); };
  draft.watch(tell, life);
  files.watch(tell, life);
  const problem = element("div");
  const start = element("button", { type: "submit" }, say("editor.start"));
  const body = element("form", { method: "dialog" },
    element("header.place-head", {}, element("h2", {}, say("editor.title")), element("button.quiet", { type: "button", onclick: () => dialog.close() }, say("cancel"))),
    element("div.editor-columns", {},
      element("div.editor-left", {}, element("fieldset.choices", {}, element("legend.unseen", {}, say("editor.tools")), ...radios), help, element("div.editor-box", {}, picture), marks,
        element("label.field", {}, element("span.field-line", {}, say("desk.frame"), time), axis), preview, partField(draft, film, footage.fps)),
      element("div.editor-right", {}, form.main, fileFields(footage, files), form.more)),
    element("footer.editor-foot", {}, sentence, problem, start));
  const dialog = element("dialog.editor", { "aria-label": say("editor.title") }, body);
  dialog.addEventListener("close", () => { closing.abort(); dialog.remove(); });
  body.addEventListener("submit", async (/** @type {Event} */ event) => {
    event.preventDefault();
    start.disabled = true;
    try {
      const params = changesOf(draft.value, fields);
      const footage_id = await withFiles(footage.id, files.value, life);
      const begun = await post("/v1/analyses", { footage_id, params }, life);
      dialog.close();
      onBegun(begun, params);
    } catch (reason) {
      if (life.aborted) return;
      showProblem(problem, reason);
      start.disabled = false;
    }
  });
  document.body.append(dialog);
  place.addEventListener("abort", () => dialog.close());
  dialog.showModal();
  focusOn(dialog, focus);
}

/** Moves the focus to the control of a parameter. @param {HTMLElement} dialog @param {string} param */
function focusOn(dialog, param) {
  const control = /** @type {HTMLElement | null} */ (TOOL_OF[param] ? dialog.querySelector("canvas") : dialog.querySelector(`[name="${param}"], [data-name="${param}"] :is(select, input)`));
  const folded = control?.closest("details");
  if (folded) folded.open = true;
  control?.focus();
}

/** Says what will be measured. @param {{settings: import("./settings.js").Settings, files: Record<string, File | null>, fields: import("./settings.js").Fields, end_s: number}} known */
function sentenceOf({ settings, files, fields, end_s }) {
  const given = changed(settings, fields).filter(([name]) => !["from_s", "to_s", "preset"].includes(name)).map(([name, value]) => say("editor.does.one", { name: settingName(name), value: settingWords(name, value) }));
  const added = Object.entries(files).flatMap(([name, file]) => (file ? say("editor.does.one", { name: say(`editor.${name}`), value: file.name }) : []));
  const list = [...(settings.preset ? [say(`editor.preset.${settings.preset}`)] : []), ...given, ...added].join(say("editor.does.and"));
  return say(list ? "editor.does" : "editor.does.usual", { part: partOf(settings, end_s), list });
}
