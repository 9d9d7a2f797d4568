// One setting: name, help, reset, and the input that fits its schema.
// @ts-check
import { element } from "../app/element.js";
import { language, say, sayOr } from "../app/words.js";
import { USUAL } from "./limits.js";

/**
 * @typedef {import("./schema.js").Field} Field
 * @typedef {{change: import("./settings.js").Change, fields: import("./schema.js").Fields}} Studio
 * @typedef {{node: HTMLElement, name: string, update: (value: any, state: {isSet: boolean, limits?: number[], perUnit?: number, isIdle?: boolean}) => void}} Control
 *   isSet: the value is not the preset's; limits beside the other settings; perUnit: steps of the API per shown unit
 *   (frames per second); isIdle: another setting makes it void
 */

let n_controls = 0;

/** Returns the words for a setting. @param {string} name */
export const nameOf = (name) => sayOr(`set.${name}`, (name.split(".").at(-1) ?? name).replaceAll("_", " "));

/** Returns the words for a choice of a setting. @param {string} name @param {string} choice */
export const choiceOf = (name, choice) => sayOr(`set.${name}.${choice}`, choice.replaceAll("_", " "));

/** Returns the control of a setting. @param {Field} field @param {Studio} studio @returns {Control} */
export function control(field, studio) {
  if (field.kind === "boolean") return toggle(field, studio);
  if (field.kind === "choice") return choice(field, studio);
  if (field.kind === "numbers") return numbers(field, studio);
  return slider(field, studio);
}

/**
 * Puts name, help and reset around an input.
 * @param {Field} field @param {Studio} studio @param {{input: HTMLInputElement | HTMLSelectElement | null, below?: HTMLElement, before?: boolean}} parts `input` stands in the line of the name
 */
export function framed({ name, help, words = name }, studio, { input, below, before = false }) {
  const id = `control-${n_controls += 1}`;
  const title = nameOf(words);
  // The service describes its settings in English only.
  const hint = sayOr(`hint.${words}`, "");
  const more = element("p.help", { id: `${id}-help`, hidden: true, ...(hint ? {} : { lang: "en" }) }, hint || help);
  const open = element("button.small-button", { type: "button", "aria-label": say("set.help", { name: title }), "aria-expanded": "false", "aria-controls": more.id, onclick: () => {
    more.hidden = !more.hidden;
    open.setAttribute("aria-expanded", String(!more.hidden));
  } }, "?");
  const reset = element("button.small-button", { type: "button", hidden: true, title: say("set.reset", { name: title }), "aria-label": say("set.reset", { name: title }), onclick: () => { studio.change({ [name]: undefined }); input?.focus(); } }, "↺");
  const label = element(input ? "label" : "span", input ? { htmlFor: input.id ||= id } : {}, title);
  const node = element("div.control", hint || language === "en" ? { title: hint || help } : {}, element("div.control-line", {}, before && input, label, (hint || help) && open, reset, !before && input), below, more);
  node.dataset.name = name;
  return { node, setReset: (/** @type {boolean} */ isSet, isIdle = false) => { reset.hidden = !isSet; node.classList.toggle("is-set", isSet); node.classList.toggle("is-idle", isIdle); } };
}

/** @param {Field} field @param {Studio} studio @returns {Control} */
function toggle(field, studio) {
  const input = element("input", { type: "checkbox", onchange: () => studio.change({ [field.name]: input.checked }) });
  const { node, setReset } = framed(field, studio, { input, before: true });
  return {
    node, name: field.name,
    update(value, { isSet, isIdle = false }) {
      input.checked = value === true;
      input.disabled = isIdle;
      setReset(isSet, isIdle);
    },
  };
}

/** @param {Field} field @param {Studio} studio @returns {Control} */
function choice(field, studio) {
  const none = field.nullable && element("option", { value: "" }, sayOr(`set.${field.name}.null`, say("set.auto")));
  const options = field.choices.map((one) => element("option", { value: one }, choiceOf(field.name, one)));
  const input = element("select", { onchange: () => studio.change({ [field.name]: input.value || null }) }, none, ...options);
  const { node, setReset } = framed(field, studio, { input });
  return {
    node, name: field.name,
    update(value, { isSet, isIdle = false }) {
      input.value = value ?? "";
      input.disabled = isIdle;
      setReset(isSet, isIdle);
    },
  };
}

/** Some numbers in a row, such as a point. @param {Field} field @param {Studio} studio @returns {Control} */
function numbers(field, studio) {
  const input = element("input.number", { type: "text", inputMode: "decimal", placeholder: say("set.auto"), onchange: () => {
    const all = input.value.split(/[,\s]+/).filter(Boolean).map(Number);
    studio.change({ [field.name]: all.length && all.every(Number.isFinite) ? all : null });
  } });
  const { node, setReset } = framed(field, studio, { input });
  return { node, name: field.name, update(value, { isSet }) { input.value = value?.join(", ") ?? ""; setReset(isSet); } };
}

/** A slider over the useful range, and a number field over the whole one. @param {Field} field @param {Studio} studio @returns {Control} */
function slider(field, studio) {
  const title = nameOf(field.name);
  const range = element("input", { type: "range", "aria-label": title });
  const number = element("input.number", { type: "number", step: "any", inputMode: "decimal" });
  const { node, setReset } = framed(field, studio, { input: number, below: range });
  // The largest value so far. The slider never ends below it, so that a person can drag back.
  let [limits, unit, shown, farthest] = [[field.min, field.max], 1, NaN, 0];
  const send = (/** @type {HTMLInputElement} */ input, /** @type {boolean} */ isFinal) => {
    const asked = Number.parseFloat(input.value) * unit;
    if (!Number.isFinite(asked)) return void (isFinal && (number.value = String(shown)));
    const kept = Math.min(limits[1], Math.max(limits[0], asked));
    if (!isFinal && kept !== asked) return undefined;
    const value = field.kind === "whole" ? Math.round(kept / field.step) * field.step : Number(kept.toPrecision(6));
    studio.change({ [field.name]: value });
    if (isFinal) number.value = String(round(value / unit));
    return undefined;
  };
  range.addEventListener("input", () => { number.value = range.value; send(range, false); });
  number.addEventListener("input", () => send(number, false));
  number.addEventListener("change", () => send(number, true));
  return {
    node, name: field.name,
    update(value, { isSet, limits: beside, perUnit = 1, isIdle = false }) {
      limits = beside ?? [field.min, field.max];
      unit = perUnit;
      const [least, most] = /** @type {Record<string, number[]>} */ (USUAL)[field.name] ?? limits;
      const known = typeof value === "number" ? value : null;
      shown = known === null ? NaN : round(known / unit);
      farthest = Math.max(farthest, known ?? 0);
      Object.assign(range, { min: Math.max(limits[0], least) / unit, max: Math.min(limits[1], Math.max(most, farthest)) / unit, step: unit === 1 ? field.step : 0.1 });
      if (known !== null && Number(range.value) !== shown) range.value = String(shown);
      if (known === null) range.value = range.min;
      range.disabled = number.disabled = isIdle;
      range.setAttribute("aria-valuetext", known === null ? say("set.auto") : String(shown));
      number.placeholder = known === null ? say("set.auto") : "";
      if (document.activeElement !== number && number.value !== String(shown)) number.value = known === null ? "" : String(shown);
      setReset(isSet, isIdle);
    },
  };
}

/** @param {number} value */
const round = (value) => Number(value.toFixed(Math.abs(value) < 1 ? 3 : 2));
