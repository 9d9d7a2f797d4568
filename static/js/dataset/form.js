// The form of a data set: films, settings from the schema of the service, samples, size, and the job.
// @ts-check
import { post, request } from "../app/api.js";
import { element } from "../app/element.js";
import { expect } from "../app/jobs.js";
import { count, say, size } from "../app/words.js";
import { problemBox } from "../parts/problem.js";
import { control } from "../studio/control.js";
import { seed } from "../studio/own-controls.js";
import { loadFields } from "../studio/schema.js";
import { filmChoice } from "./films.js";
import { checks } from "./checks.js";
import { bodyOf, CAMERA, MAIN, SCENE } from "./settings.js";

/** @param {{libraries: Api.Library[], chosen: string[], life: AbortSignal}} options chosen: ids of the libraries to begin with */
export async function datasetForm({ libraries, chosen, life }) {
  const [fields, flock] = await Promise.all([loadFields("Dataset"), loadFields()]);
  /** @type {import("../studio/settings.js").Settings} */
  let settings = {};
  /** @type {import("../studio/settings.js").Change} */
  const change = (patch) => {
    settings = Object.fromEntries(Object.entries({ ...settings, ...patch }).filter(([, value]) => value !== undefined));
    update();
  };
  const controlOf = (/** @type {string} */ name) => {
    const field = /** @type {import("../studio/schema.js").Field} */ (fields.get(name));
    if (name === "presets") return checks({ ...field, choices: flock.get("preset")?.choices ?? [] }, "preset", { change, fields });
    if (name === "seed") return seed(field, { change, fields });
    // Of a flock, it is one number.
    if (name === "count") return control({ ...field, words: "counts" }, { change, fields });
    return name === "formats" ? checks(field, "label", { change, fields }) : control(field, { change, fields });
  };
  const known = (/** @type {string[]} */ names) => names.filter((name) => fields.has(name)).map(controlOf);
  const [main, scene, camera] = [MAIN, SCENE, CAMERA].map(known);
  const films = filmChoice(libraries, chosen, () => update());
  const [licence, source] = ["licence", "source"].map((name) => element("input", { type: "text", maxLength: 1000, autocomplete: "off", name, oninput: () => update() }));
  const see = element("button.quiet", { type: "button", onclick: () => run(see, samples) }, say("data.see"));
  const make = element("button", { type: "button", onclick: () => run(make, start) }, say("data.make"));
  const [picture, told, trouble] = [element("div.data-sheet"), element("p.soft", { role: "status" }), element("div")];

  const asked = () => ({ library_ids: films.chosen(), licence: licence.value.trim() || null, source: source.value.trim() || null, ...bodyOf(settings, fields) });
  const update = () => {
    for (const { name, update: show } of [...main, ...scene, ...camera]) show(settings[name] ?? fields.get(name)?.default, { isSet: name in settings });
    see.disabled = make.disabled = films.chosen().length === 0;
    // They are of other settings.
    picture.classList.toggle("is-old", picture.childElementCount > 0);
    told.textContent = films.chosen().length === 0 ? say("data.choose") : "";
  };
  /** Runs what a button does, with the button disabled. @param {HTMLButtonElement} button @param {() => Promise<void>} work */
  async function run(button, work) {
    see.disabled = make.disabled = true;
    trouble.replaceChildren();
    try {
      await work();
    } catch (problem) {
      if (life.aborted) return;
      told.textContent = "";
      trouble.replaceChildren(problemBox(problem));
    }
    see.disabled = make.disabled = films.chosen().length === 0;
    if (document.activeElement === document.body) button.focus();
  }
  async function samples() {
    told.textContent = say("data.drawing");
    const body = asked();
    const answer = await request("POST", "/v1/datasets/preview", { body, signal: life });
    const sheet = element("img", { src: URL.createObjectURL(await answer.blob()), alt: say("data.sheet") });
    life.addEventListener("abort", () => URL.revokeObjectURL(sheet.src));
    picture.replaceChildren(sheet, element("p.soft", {}, say("data.sheet.what")));
    picture.classList.remove("is-old");
    told.textContent = sizeText(await post("/v1/datasets/estimate", body, life));
  }
  async function start() {
    told.textContent = say("data.estimating");
    const { job_id, estimate } = await post("/v1/datasets", asked(), life);
    await expect(job_id);
    told.textContent = say("data.started", { size: sizeText(estimate) });
  }

  const group = (/** @type {string} */ name, /** @type {import("../studio/control.js").Control[]} */ controls) => element("details.group", {}, element("summary", {}, say(`data.${name}`)), element("div.settings", {}, ...controls.map(({ node }) => node)));
  const text = (/** @type {HTMLInputElement} */ input, /** @type {string} */ label) => element("label.data-text", {}, element("span", {}, label), input);
  update();
  return element("section.data-form", { "aria-label": say("data.new") }, element("h2", {}, say("data.new")), films.node,
    element("div.settings", {}, ...main.map(({ node }) => node)), group("scene", scene), group("camera", camera),
    element("div.settings", {}, text(source, say("data.source")), text(licence, say("data.licence"))),
    element("p.actions", {}, make, see), told, trouble, picture);
}

/** @param {Api.Schemas["DatasetEstimate"]} estimate */
const sizeText = ({ pictures, size_bytes, drawing_s }) => say("data.size", { pictures: count(pictures), size: size(size_bytes), n: Math.max(1, Math.round(drawing_s / 60)) });
