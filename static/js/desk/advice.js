// What to check after a measurement: the view that was guessed, other things that move, and advice. Each is a card
// with a picture that shows it and the button that mends it.
// @ts-check
import { element } from "../app/element.js";
import { percent, say, sayOr } from "../app/words.js";
import { pictureOf } from "./advice-picture.js";
import { disturbed } from "./disturbed.js";

/**
 * Buttons that mend, by the code of the advice: settings to begin "Measure again" with, the tool to point with,
 * or a tab to show.
 * @type {Record<string, {name: string, params?: Api.AnalysisChanges, tool?: string, tab?: string}>}
 */
const MENDS = {
  several_animals: { name: "point", tool: "animal_at" },
  foreign_frames: { name: "part", tool: "from_s" },
  camera_unsteady: { name: "part", tool: "from_s" },
  light_changes: { name: "part", tool: "from_s" },
  seldom_found: { name: "point", tool: "animal_at" },
  little_playback: { name: "looser", params: { kappa: 3 } },
  no_transitions: { name: "looser", params: { kappa: 3 } },
  few_jumps: { name: "looser", params: { kappa: 3 } },
  loose_jumps: { name: "see_jumps", tab: "jumps" },
  animal_too_small: { name: "sprites", params: { sprites: "always" } },
};
/** Advice that has a card of its own kind: the view, and things that move. */
const SHOWN_ELSEWHERE = ["view_unsure", "other_movers"];
/** Most cards of other things that move. */
const MOST_MOVERS = 6;

/** @typedef {{remeasure: (tool?: string, params?: Api.AnalysisChanges) => void, showTab: (tab: string) => void}} Acts */

/** Returns the cards, which appear when the measurement is loaded. @param {import("./instrument.js").Instrument} desk @param {{pictures: import("./pictures.js").Pictures, shoot: import("./shots.js").Shoot, acts: Acts}} parts */
export function adviceCards(desk, { pictures, shoot, acts }) {
  const { library, life } = desk;
  const list = element("ul.advices", {}, element("li.soft", {}, say("desk.reading.wait")));
  desk.isLoaded.watch((isLoaded) => {
    if (!isLoaded) return;
    const movers = (desk.head.value?.other_movers ?? []).slice(0, MOST_MOVERS);
    const told = (library.advice ?? []).filter(({ code }) => !SHOWN_ELSEWHERE.includes(code));
    list.replaceChildren(...told.map((one) => adviceCard(desk, one, { pictures, shoot, acts })),
      ...movers.map((one) => moverCard(desk, one, shoot, acts)), viewCard(desk, shoot, acts));
  }, life);
  return list;
}

/** @param {string} kind @param {Node | null} picture @param {string} sentence @param {{name: string, act: () => void}[]} buttons */
const card = (kind, picture, sentence, buttons) => element("li.advice", { className: `advice ${kind}` }, picture, element("p", {}, sentence),
  buttons.length > 0 && element("p.actions", {}, ...buttons.map(({ name, act }) => element("button.quiet", { type: "button", onclick: act }, say(`desk.mend.${name}`)))));

/** @param {import("./instrument.js").Instrument} desk @param {{code: string, sentence: string}} advice @param {{pictures: import("./pictures.js").Pictures, shoot: import("./shots.js").Shoot, acts: Acts}} parts */
function adviceCard(desk, { code, sentence }, { pictures, shoot, acts }) {
  // A compass shows headings, not turns.
  const mend = /^lacks_.*(turn|straight)$/.test(code) ? MENDS.few_jumps : code.startsWith("lacks_") ? { name: "compass", tab: "pose" } : MENDS[code];
  const act = () => (mend.tab ? acts.showTab(mend.tab) : acts.remeasure(mend.tool ?? Object.keys(mend.params ?? {})[0], mend.params));
  return card("is-advice", pictureOf(code, { desk, pictures, shoot }), sentenceOf(desk, code, sentence), mend ? [{ name: mend.name, act }] : []);
}

/** Returns the words of an advice with its figures, else the sentence of the service. @param {import("./instrument.js").Instrument} desk @param {string} code @param {string} sentence */
function sentenceOf({ library, facts, start_s, end_s }, code, sentence) {
  const stats = facts.value?.stats ?? {};
  const { n, longest } = disturbed(code, stats.disturbances);
  if (longest) return say(`desk.advice.${code}`, { n, from: longest.from_s.toFixed(1), to: longest.to_s.toFixed(1) });
  const values = { seen: percent(library.detected_share), playable: percent(library.component_share), playable_s: library.component_share * (end_s - start_s), first_s: stats.first_foreign_s ?? 0, n: stats.n_foreign_frames ?? 0, times: stats.kappa_used ?? 0 };
  return sayOr(`desk.advice.${code}`, sentence.charAt(0).toUpperCase() + sentence.slice(1).replace(/([^.])$/, "$1."), values);
}

/** The view that was found, with a button that chooses the other view. @param {import("./instrument.js").Instrument} desk @param {import("./shots.js").Shoot} shoot @param {Acts} acts */
function viewCard(desk, shoot, { remeasure }) {
  const { library, columns: { value: columns } } = desk;
  const sure = desk.head.value?.view_confidence;
  const other = library.view === "side" ? "top" : "side";
  const view = say(`desk.view.${library.view}`);
  // The frame in which the animal shows the most of itself.
  let best = desk.first;
  for (let k = desk.first; k <= desk.last() && k < columns.n; k++) if (columns.detected[k] && !columns.cut[k] && !(columns.length_px[k] <= columns.length_px[best])) best = k;
  const picture = shoot({ frame: best, label: say("desk.view.label", { view }), hasMarks: true, around_px: columns.detected[best] ? [...columns.box_px.subarray(4 * best, 4 * best + 4)] : undefined });
  const sentence = sure === undefined ? say("desk.view.given", { view }) : say("desk.view.guess", { view, share: percent(sure) });
  return card(sure !== undefined && sure < 0.9 ? "is-advice" : "is-fact", picture, sentence, [{ name: other, act: () => remeasure("view", { view: other }) }]);
}

/** One thing that moves besides the animal. @param {import("./instrument.js").Instrument} desk @param {Api.Mover} mover @param {import("./shots.js").Shoot} shoot @param {Acts} acts */
function moverCard(desk, { kind, from_s, to_s, box_px }, shoot, { remeasure }) {
  const frame = Math.min(desk.last(), Math.max(desk.first, desk.frameOf((from_s + to_s) / 2)));
  const [x, y, w, h] = box_px;
  const sentence = say(`desk.mover.${kind}`, { from: from_s.toFixed(1), to: to_s.toFixed(1) });
  // The box holds the thing at all times; elsewhere in time the animal may pass there.
  const ignored = [...(desk.library.params?.ignore ?? []), { box_px, from_s, to_s }];
  return card("is-mover", shoot({ frame, label: sentence, box_px, hasMarks: true }), sentence, [
    { name: "ignore_this", act: () => remeasure("ignore", { ignore: ignored }) },
    { name: "this_one", act: () => { desk.goTo(frame); remeasure("animal_at", { animal_at: { frame, at_px: [x + w / 2, y + h / 2] } }); } },
    { name: "see_it", act: () => { desk.goTo(frame); document.querySelector("div.stage")?.scrollIntoView({ block: "nearest" }); } },
  ]);
}
