// A problem beside its cause: the reason, the picture that shows it, advice, and buttons that mend it.
// @ts-check
import { element } from "../app/element.js";
import { say, sayOr, wordsOfService } from "../app/words.js";

/** @typedef {{label: string, act: () => void, quiet?: boolean}} Mend */

/** Returns the words for a reason: those of its code in the language of the page, else those of the service. @param {unknown} reason a Problem, or any error */
export async function reasonOf(reason) {
  await wordsOfService();
  const { code, title, message } = /** @type {Partial<import("../app/api.js").Problem>} */ (reason);
  return sayOr(`code.${code}`, title ?? message ?? "");
}

/**
 * Returns the box of a problem, which fills when its words are there. @param {unknown} reason a Problem, or any error @param {Mend[]} [mends]
 */
export function problemBox(reason, mends = []) {
  const node = element("div.problem", { role: "alert" });
  const fill = (/** @type {string} */ title) => node.append(...partsOf(/** @type {Partial<import("../app/api.js").Problem>} */ (reason), title, mends));
  reasonOf(reason).then(fill);
  return node;
}

/** @param {Partial<import("../app/api.js").Problem>} problem @param {string} title @param {Mend[]} mends */
function partsOf(problem, title, mends) {
  const detail = problem.detail && problem.detail !== problem.title ? sentence(withoutCommands(problem.detail)) : "";
  const advice = withoutCommands(sayOr(`code.${problem.code}.advice`, problem.advice ?? ""));
  const parts = [
    element("strong", {}, title),
    // The service tells where and when in English only.
    detail && element("p", problem.code ? { lang: "en" } : {}, detail),
    problem.picture && element("img", { src: problem.picture, alt: say("problem.picture"), loading: "lazy" }),
    advice && element("p", {}, advice),
    mends.length > 0 && element("p.actions", {}, ...mends.map(({ label, act, quiet }) => element(quiet ? "button.quiet" : "button", { type: "button", onclick: act }, label))),
    problem.code && element("small", {}, element("a", { href: `/docs/errors#${problem.code}` }, say("problem.code", { code: problem.code }))),
  ];
  return parts.flatMap((part) => part || []);
}

/** Takes away examples for the command line, which a person on the page cannot use. @param {string} text */
export const withoutCommands = (text) => text.replace(/,?( for example)? with `[^`]* -[^`]*`| \(`--[^`]*`\)/g, "").replaceAll("`", "");

/** Returns a cause of the service as a sentence. @param {string} text */
const sentence = (text) => (/^ff(mpeg|probe)/.test(text) ? text : text[0].toUpperCase() + text.slice(1)) + (/[.!?。]$/.test(text) ? "" : ".");

/** Replaces the content of an element by the box of a problem. @param {Element} place @param {unknown} problem @param {Mend[]} [mends] */
export const showProblem = (place, problem, mends) => place.replaceChildren(problemBox(problem, mends));
