// Jumps: their order, the next one, and the table of the best, which is the accessible twin of the matrix.
// @ts-check
import { element } from "../app/element.js";
import { count, say } from "../app/words.js";
import { framesOf } from "./instrument.js";

/** Rows of the table. */
const BEST = 20;

/**
 * Returns the function that plays the next jump after the moment, and from the last one on while nothing else
 * moved the film.
 * @param {import("./instrument.js").Instrument} desk @param {import("./player.js").Player} player
 */
export function jumpPlayer(desk, player) {
  let last = -1;
  let landed = -1;
  return () => {
    const { facts: { value: facts }, moment, showsMirrored } = desk;
    const jumps = shownJumps(facts, showsMirrored.value).map((one) => framesOf(one, facts?.clip_frames ?? 8)).filter(({ from, to }) => from >= desk.first && to <= desk.last()).sort((a, b) => a.from - b.from || a.to - b.to);
    if (!jumps.length) return;
    const goesOn = last >= 0 && desk.jump.value && (player.isPlaying.value || moment.value === landed) && jumps[last];
    last = goesOn ? (last + 1) % jumps.length : Math.max(0, jumps.findIndex(({ from }) => from >= moment.value));
    player.playJump(jumps[last]);
    landed = Math.min(desk.last(), jumps[last].to + Math.round(desk.library.fps));
  };
}

/** Returns the jumps to show. @param {import("./instrument.js").Facts | null} facts @param {boolean} withMirrored */
export const shownJumps = (facts, withMirrored) => (facts?.jumps ?? []).filter(({ mirrored }) => withMirrored || !mirrored);

/** @param {import("./instrument.js").Instrument} desk @param {import("./player.js").Player} player */
export function jumpTable(desk, player) {
  const body = element("tbody");
  const none = element("p.soft", { hidden: true }, say("desk.jumps.none"));
  const heads = ["from", "to", "kind", "distance", "play"].map((name) => element("th", { scope: "col" }, name === "play" ? element("span.unseen", {}, say("desk.jumps.play")) : say(`desk.jumps.${name}`)));
  const table = element("table.jumps", {}, element("caption.unseen", {}, say("desk.jumps.best")), element("thead", {}, element("tr", {}, ...heads)), body);
  const fill = () => {
    const facts = desk.facts.value;
    if (!facts) return;
    const rows = shownJumps(facts, desk.showsMirrored.value).slice(0, BEST);
    none.hidden = rows.length > 0;
    table.hidden = rows.length === 0;
    body.replaceChildren(...rows.map((one) => rowOf(one, desk, player)));
  };
  desk.facts.watch(fill, desk.life);
  desk.showsMirrored.watch(fill, desk.life);
  return element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("desk.jumps.best") }, table, none);
}

/** @param {import("./instrument.js").Jump} one @param {import("./instrument.js").Instrument} desk @param {import("./player.js").Player} player */
function rowOf(one, desk, player) {
  const { clip_frames, natural_step } = /** @type {import("./instrument.js").Facts} */ (desk.facts.value);
  const frames = framesOf(one, clip_frames);
  const when = (/** @type {number} */ frame) => element("td", {}, say("desk.jumps.when", { time: desk.timeOf(frame).toFixed(2) }), " ", element("small", {}, say("desk.jumps.frame", { frame: String(frame) })));
  return element("tr", { className: one.mirrored ? "mirrored" : "" },
    when(frames.from), when(frames.to),
    element("td", {}, element("span.kind", {}, say(one.mirrored ? "desk.jumps.mirrored" : "desk.jumps.plain"))),
    element("td", {}, natural_step ? say("desk.jumps.steps", { n: count(one.distance / natural_step) }) : count(one.distance)),
    element("td", {}, element("button.quiet", { type: "button", "aria-label": say("desk.jumps.play_one", { from: String(frames.from), to: String(frames.to) }), onclick: () => player.playJump(frames) }, say("desk.jumps.play"))));
}
