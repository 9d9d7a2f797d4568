// Settings with controls of their own: preset, background, size, files, seed.
// @ts-check
import { element } from "../app/element.js";
import { say, sayOr } from "../app/words.js";
import { choiceOf, framed, nameOf } from "./control.js";
import { impliedChanges } from "./implied.js";
import { CLEAR } from "./ways.js";

/** @typedef {import("./control.js").Control} Control @typedef {import("./control.js").Studio} Studio */

/** Sizes that editors ask for. */
const SIZES = [[1280, 720], [1920, 1080], [1080, 1920], [1080, 1080]];

/** Returns one of several choices that are all in sight. @param {string} name @param {string} value @param {string} label @param {() => void} choose @param {string} [help] */
export const radio = (name, value, label, choose, help = "") => {
  const input = element("input", { type: "radio", name, value, onchange: choose });
  return { input, node: element("label.chip", { title: help }, input, element("span", {}, label)) };
};

/** The choice without a preset: the flock lives as the filmed animal does. */
const NATURAL = "natural";

/** Buttons for the behaviors. @param {Studio} studio */
export function presets(studio) {
  const names = [NATURAL, ...(studio.fields.get("preset")?.choices ?? [])];
  const all = names.map((name) => radio("preset", name, choiceOf("preset", name), () => studio.change({ preset: name === NATURAL ? undefined : name }), sayOr(`preset.${name}`, "")));
  const help = element("p.soft");
  return {
    node: element("fieldset.presets", {}, element("legend", {}, nameOf("preset")), element("div.chips", {}, ...all.map(({ node }) => node)), help),
    update(/** @type {string | undefined} */ name) {
      for (const { input } of all) input.checked = input.value === (name ?? NATURAL);
      help.textContent = sayOr(`preset.${name ?? NATURAL}`, "");
    },
  };
}

/** @param {import("./schema.js").Field} field @param {Studio} studio @returns {Control} */
export function seed(field, studio) {
  const input = element("input.number", { type: "number", min: 0, step: 1 });
  const dice = element("button.small-button", { type: "button", title: say("set.dice"), "aria-label": say("set.dice"), onclick: () => studio.change({ seed: 1 + Math.floor(Math.random() * 9999) }) }, "⚄");
  input.addEventListener("input", () => { if (input.validity.valid && input.value) studio.change({ seed: Number(input.value) }); });
  const { node, setReset } = framed(field, studio, { input });
  input.before(dice);
  return { node, name: "seed", update(value, { isSet }) { if (document.activeElement !== input) input.value = String(value ?? 1); setReset(isSet); } };
}

/** Boxes for formats of files. @param {string[]} formats @param {(checked: string[]) => void} choose @param {string} label */
function formatBoxes(formats, choose, label) {
  const all = formats.map((name) => {
    const input = element("input", { type: "checkbox", value: name, onchange: () => choose(all.filter((one) => one.input.checked).map((one) => one.name)) });
    return { name, input, node: element("label.check", {}, input, element("span", {}, choiceOf("format", name))) };
  });
  const update = (/** @type {string[]} */ checked) => { for (const { name, input } of all) input.checked = checked.includes(name); };
  return { node: element("div.checks", { role: "group", "aria-label": label }, ...all.map((one) => one.node)), update };
}

/** Plate, transparent or a color. @param {import("./schema.js").Field} field @param {Studio} studio @param {{formats: string[], valueOf: (name: string) => any}} known @returns {Control} */
export function background(field, studio, { formats, valueOf }) {
  const color = element("input.color", { type: "color", value: "#103040", "aria-label": say("set.background.color.pick") });
  const choose = (/** @type {string} */ what) => {
    studio.change({ "render.background": what === "plate" ? undefined : what === "color" ? color.value : what, ...impliedChanges(what, studio.fields, valueOf) });
  };
  const all = ["plate", "transparent", "color"].map((what) => radio("background", what, say(`set.background.${what}`), () => choose(what)));
  color.addEventListener("input", () => choose("color"));
  // The formats that keep transparency, as they are also among the files.
  const kept = formatBoxes(formats.filter((one) => CLEAR.includes(one)), (checked) => {
    const others = (valueOf("render.formats") ?? []).filter((/** @type {string} */ one) => !CLEAR.includes(one));
    if (checked.length) studio.change({ "render.formats": [...others, ...checked] });
    else kept.update(valueOf("render.formats"));
  }, say("set.background.files"));
  const note = element("div.background-files", { hidden: true }, kept.node, element("p.soft", {}, say("set.background.note")));
  const { node, setReset } = framed(field, studio, { input: null, below: element("div.chips", { role: "radiogroup", "aria-label": nameOf(field.name) }, ...all.map((one) => one.node), color) });
  node.append(note);
  return {
    node, name: field.name,
    update(value, { isSet }) {
      const isColor = String(value).startsWith("#");
      for (const { input } of all) input.checked = input.value === (isColor ? "color" : value ?? "plate");
      if (isColor) color.value = value;
      color.hidden = !isColor;
      note.hidden = value !== "transparent";
      kept.update(valueOf("render.formats") ?? []);
      setReset(isSet);
    },
  };
}

/** @param {import("./schema.js").Field} field @param {Studio} studio @param {number[]} film width and height @returns {Control} */
export function size(field, studio, film) {
  const sizes = [film.map((side) => side * 2), film.map((side) => Math.round(side / 2)), ...SIZES].filter((one) => one.every((side) => side >= 16 && side <= 8192) && one[0] * one[1] <= 8_294_400);
  const input = element("select", { onchange: () => studio.change({ [field.name]: input.value === "film" ? undefined : input.value.split(",").map(Number) }) });
  const option = (/** @type {number[]} */ one) => element("option", { value: one.join() }, one.join(" × "));
  input.append(element("option", { value: "film" }, say("set.size.film", { size: film.join(" × ") })), ...sizes.map(option));
  const { node, setReset } = framed(field, studio, { input });
  return {
    node, name: field.name,
    update(value, { isSet }) {
      const text = Array.isArray(value) ? value.join() : "film";
      if (![...input.options].some((one) => one.value === text)) input.append(option(value));
      input.value = text;
      setReset(isSet);
    },
  };
}

/** Files besides video.mp4. @param {import("./schema.js").Field} field @param {Studio} studio @param {string[]} formats @returns {Control} */
export function files(field, studio, formats) {
  const boxes = formatBoxes(formats.filter((one) => one !== "mp4"), (checked) => studio.change({ [field.name]: checked }), nameOf(field.name));
  const { node, setReset } = framed(field, studio, { input: null, below: boxes.node });
  return {
    node, name: field.name,
    update(value, { isSet }) {
      boxes.update(Array.isArray(value) ? value : []);
      setReset(isSet);
    },
  };
}
