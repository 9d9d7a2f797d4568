// Buttons that mend a refused film: each changes one setting and measures again.
// @ts-check
import { say } from "../app/words.js";

/** Settings that help after a refusal, by its code. The key of the words is `mend.` and the name. */
/** @type {Record<string, {name: string, params: Api.AnalysisChanges}[]>} */
const MENDS = {
  several_animals: [{ name: "follow_largest", params: { follow: "largest" } }],
  nothing_moves: [{ name: "lower_threshold", params: { threshold: 10 } }],
  animal_too_small: [{ name: "lower_threshold", params: { threshold: 10 } }],
  background_not_static: [{ name: "follow_largest", params: { follow: "largest" } }],
  camera_moved: [{ name: "first_part", params: { to_s: 10 } }],
  light_changes: [{ name: "first_part", params: { to_s: 10 } }],
  scene_changes: [{ name: "first_part", params: { to_s: 10 } }],
  time_limit: [{ name: "first_minute", params: { to_s: 60 } }],
  memory_limit: [{ name: "first_minute", params: { to_s: 60 } }],
};

/**
 * Returns the buttons for a problem. @param {unknown} problem @param {(params: Api.AnalysisChanges) => void} measure
 * @param {number} [length_s] length of the film: a part as long as the film mends nothing
 * @returns {import("./problem.js").Mend[]}
 */
export function mendsOf(problem, measure, length_s = Infinity) {
  const mends = MENDS[/** @type {Partial<import("../app/api.js").Problem>} */ (problem).code ?? ""] ?? [];
  return mends.filter(({ params }) => !((params.to_s ?? 0) >= length_s)).map(({ name, params }) => ({ label: say(`mend.${name}`), act: () => measure(params) }));
}
