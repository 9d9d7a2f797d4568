// The part of the film that is measured: two handles on an axis.
// @ts-check
import { element } from "../app/element.js";
import { say, seconds } from "../app/words.js";

/** Shortest part that can be chosen, s. Free choice; the service needs 16 frames. */
const LEAST_S = 0.5;

/** Returns the part in words. @param {import("./settings.js").Settings} settings @param {number} end_s */
export const partOf = ({ from_s = null, to_s = null }, end_s) => (from_s === null && to_s === null ? say("editor.part.whole") : say("editor.part.of", { from: seconds(from_s ?? 0), to: seconds(to_s ?? end_s) }));

/** @param {import("./editor.js").Draft} draft @param {import("./film.js").Film} film @param {number} fps */
export function partField(draft, film, fps) {
  const end_s = Math.ceil(film.end_s * 10) / 10;
  const output = element("output");
  const fill = element("i");
  const handle = (/** @type {"from_s" | "to_s"} */ name) => {
    const input = element("input", { type: "range", name, min: 0, max: end_s, step: 0.1, "aria-label": say(`set.${name}`) });
    input.addEventListener("input", () => {
      const other = name === "from_s" ? draft.value.to_s ?? end_s : draft.value.from_s ?? 0;
      const value = name === "from_s" ? Math.min(input.valueAsNumber, other - LEAST_S) : Math.max(input.valueAsNumber, other + LEAST_S);
      draft.set({ ...draft.value, [name]: value <= 0 || value >= end_s ? null : Math.round(value * 10) / 10 });
      film.goTo(value * fps);
    });
    return input;
  };
  const [from, to] = [handle("from_s"), handle("to_s")];
  draft.watch((now) => {
    const [a, b] = [now.from_s ?? 0, now.to_s ?? end_s];
    [from.value, to.value] = [String(a), String(b)];
    output.textContent = partOf(now, end_s);
    fill.style.insetInline = `${(100 * a) / end_s}% ${100 - (100 * b) / end_s}%`;
  });
  return element("div.field", { role: "group", "aria-label": say("editor.part") }, element("span.field-line", {}, say("editor.part"), output), element("div.two-handles", {}, fill, from, to));
}
