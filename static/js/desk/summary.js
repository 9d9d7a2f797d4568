// The motion in numbers: distance, speeds, rest and turns, in centimetres if the film has a scale.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { count, say, seconds } from "../app/words.js";
import { showProblem } from "../parts/problem.js";

/** @param {import("./instrument.js").Instrument} desk */
export function summaryCard(desk) {
  const node = element("div", { "aria-live": "polite" });
  desk.scale.watch(async () => {
    try {
      const summary = await get(`/v1/libraries/${desk.library.id}/summary.json`, desk.life);
      const unit = summary.px_per_cm ? "cm" : "bl";
      // Another scale was set in the meantime.
      if (summary.px_per_cm !== desk.scale.value) return;
      node.replaceChildren(element("dl.numbers.motion-numbers", {}, ...rowsOf(summary, unit).map(([key, value]) => element("div", {}, element("dt", {}, say(`desk.motion.${key}`), element("small", {}, say(`desk.motion.${key}.means`))), element("dd", {}, value)))));
    } catch (problem) {
      if (!desk.life.aborted) showProblem(node, problem);
    }
  }, desk.life);
  return node;
}

/** @param {Api.SummaryFile} summary @param {"cm" | "bl"} unit @returns {string[][]} keys of the words, and values */
function rowsOf(summary, unit) {
  const speed = (/** @type {"mean" | "median" | "peak"} */ name) => [name, summary[`${name}_speed_${unit}_per_s`], (/** @type {number} */ n) => `${count(n)} ${say(`unit.speed.${unit}`)}`];
  const distance = (/** @type {number} */ n) => (unit === "cm" && n >= 100 ? say("unit.m", { n: n / 100 }) : say(`unit.${unit}`, { n }));
  const rows = /** @type {[string, number | null, (n: number) => string][]} */ ([
    ["distance", summary[`distance_${unit}`], distance], speed("mean"), speed("median"), speed("peak"),
    ["rest", summary.rest_s, (/** @type {number} */ n) => (summary.n_rest_bouts ? `${seconds(n)} · ${say("desk.motion.bouts", { n: summary.n_rest_bouts })}` : seconds(n))],
    ["turns", summary.turns_per_min, count],
  ]);
  return rows.flatMap(([key, value, words]) => (value === null ? [] : [[key, words(value)]]));
}
