// The title of a shared reel: how many animals, of which film, and what they do.
// @ts-check
import { filmName } from "../app/names.js";
import { say } from "../app/words.js";
import { orderKindOf } from "../studio/facts.js";

/**
 * @param {Pick<import("../flock/plan.js").Plan, "head" | "nIndividuals">} plan
 * @param {string} disposition header of the plan, with the name under which it is saved, such as "finch_40x400_s1.plan"
 */
export function sharedTitle({ head: { params, stats }, nIndividuals: n }, disposition) {
  const film = filmOf(disposition);
  const title = film ? say("flock.of", { n, film }) : say("shared.title", { n });
  if (n === 1) return title;
  return say(`shared.does.${params.predator ? "flee" : orderKindOf(stats)}`, { title });
}

/** Returns the name of the film in the name of a file; empty if there is none. @param {string} disposition */
function filmOf(disposition) {
  const name = /filename\*=UTF-8''([^;]*)_\d+x\d+_s\d+\.plan/.exec(disposition)?.[1];
  return name ? filmName(/** @type {Api.Footage} */ ({ name: `${decodeURIComponent(name).replaceAll("-", " ")}.plan` })) : "";
}
