// Mends of a refused film, as the service proposes them. Each is a button that opens the editor at its control.
// @ts-check
import { count, say, sayOr, seconds } from "../app/words.js";

/** @typedef {Api.Schemas["Mend"]} Mend */

/**
 * Returns the buttons for a problem. @param {unknown} problem @param {(mend: Mend) => void} open
 * @returns {import("../parts/problem.js").Mend[]}
 */
export function mendsOf(problem, open) {
  const mends = /** @type {Partial<import("../app/api.js").Problem>} */ (problem).mends ?? [];
  const buttons = mends.map((mend, k) => ({ label: labelOf(mend), act: () => open(mend), quiet: k > 0 }));
  // A start and an end that nobody proposes are chosen at the same control.
  return buttons.filter(({ label }, k) => buttons.findIndex((other) => other.label === label) === k);
}

/** @param {Mend} mend */
function labelOf({ param, value }) {
  const known = /** @type {any} */ (value);
  if (known === null || known === undefined) return sayOr(`mend.${param}`, param);
  if (param === "animal_at") return say("mend.animal_at.value", { at: known.at_px.map(Math.round).join(", ") });
  const n = typeof known !== "number" ? "" : param.endsWith("_s") ? seconds(known) : count(known);
  return sayOr(`mend.${param}.value`, sayOr(`mend.${param}`, param), { n });
}
