// A problem beside its cause: the reason, the picture that shows it, advice, and buttons that mend it.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";

/** @typedef {{label: string, act: () => void, quiet?: boolean}} Mend */

/**
 * Returns the box of a problem. @param {unknown} reason a Problem, or any error @param {Mend[]} [mends]
 */
export function problemBox(reason, mends = []) {
  const problem = /** @type {Partial<import("../app/api.js").Problem>} */ (reason);
  const title = problem.title ?? problem.message;
  const detail = problem.detail && problem.detail !== title ? sentence(problem.detail) : "";
  return element("div.problem", { role: "alert" },
    element("strong", {}, title),
    detail && element("p", {}, detail),
    problem.picture && element("img", { src: problem.picture, alt: say("problem.picture"), loading: "lazy" }),
    problem.advice && element("p", {}, problem.advice.replaceAll("`", "")),
    mends.length > 0 && element("p.actions", {}, ...mends.map(({ label, act, quiet }) => element(quiet ? "button.quiet" : "button", { type: "button", onclick: act }, label))),
    problem.code && element("small", {}, element("a", { href: `/docs/errors#${problem.code}` }, say("problem.code", { code: problem.code }))));
}

/** Returns a cause of the service as a sentence. @param {string} text */
const sentence = (text) => (/^ff(mpeg|probe)/.test(text) ? text : text[0].toUpperCase() + text.slice(1)) + (/[.!?。]$/.test(text) ? "" : ".");

/** Replaces the content of an element by the box of a problem. @param {Element} place @param {unknown} problem @param {Mend[]} [mends] */
export const showProblem = (place, problem, mends) => place.replaceChildren(problemBox(problem, mends));
