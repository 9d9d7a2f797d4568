// Fields of "Measure again": view, animals, threshold, part of the film, preset.
// @ts-check
import { element } from "../app/element.js";
import { say, seconds } from "../app/words.js";

/**
 * @typedef {import("../app/store.js").Signal<Api.AnalysisParams & {ignore: Api.Schemas["IgnoreParam"][]}>} Draft the parameters to be sent
 */

/** Returns a field that chooses one of some values. @param {Draft} draft @param {"view" | "follow" | "sprites"} name @param {(string | null)[]} values */
export function choice(draft, name, values) {
  const select = element("select", { name, onchange: () => draft.set({ ...draft.value, [name]: values[select.selectedIndex] }) }, ...values.map((value) => element("option", { value: value ?? "" }, say(`remeasure.${name}.${value ?? "null"}`))));
  draft.watch((now) => { select.selectedIndex = values.indexOf(now[name] ?? null); });
  return element("label.field", {}, say(`remeasure.${name}`), select, element("small", {}, say(`remeasure.${name}.help`)));
}

/** Returns a slider. @param {Draft} draft @param {"threshold" | "kappa"} name @param {{min: number, max: number, step: number}} range */
export function slide(draft, name, range) {
  const output = element("output");
  const input = element("input", { type: "range", name, ...range, oninput: () => draft.set({ ...draft.value, [name]: input.valueAsNumber }) });
  draft.watch((now) => { input.value = String(now[name]); output.textContent = String(now[name]); });
  return element("label.field", {}, element("span.field-line", {}, say(`remeasure.${name}`), output), input, element("small", {}, say(`remeasure.${name}.help`)));
}

/** Returns two handles on an axis of the film. @param {Draft} draft @param {import("./instrument.js").Instrument} desk */
export function part(draft, desk) {
  const end_s = Math.ceil((Math.max(desk.count(), desk.last() + 1) / desk.library.fps) * 10) / 10;
  const output = element("output");
  const fill = element("i");
  const handle = (/** @type {"from_s" | "to_s"} */ name) => {
    const input = element("input", { type: "range", name, min: 0, max: end_s, step: 0.1, "aria-label": say(`remeasure.${name}`) });
    input.addEventListener("input", () => {
      const other = name === "from_s" ? draft.value.to_s ?? end_s : draft.value.from_s ?? 0;
      const value = name === "from_s" ? Math.min(input.valueAsNumber, other - 0.5) : Math.max(input.valueAsNumber, other + 0.5);
      draft.set({ ...draft.value, [name]: value <= 0 || value >= end_s ? null : Math.round(value * 10) / 10 });
      desk.goTo(desk.frameOf(value));
    });
    return input;
  };
  const [from, to] = [handle("from_s"), handle("to_s")];
  draft.watch((now) => {
    const [a, b] = [now.from_s ?? 0, now.to_s ?? end_s];
    [from.value, to.value] = [String(a), String(b)];
    output.textContent = now.from_s === null && now.to_s === null ? say("remeasure.part.whole") : say("remeasure.part.of", { from: seconds(a), to: seconds(b) });
    fill.style.insetInline = `${(100 * a) / end_s}% ${100 - (100 * b) / end_s}%`;
  });
  return element("div.field", { role: "group", "aria-label": say("remeasure.part") }, element("span.field-line", {}, say("remeasure.part"), output), element("div.two-handles", {}, fill, from, to));
}
