// The picture of an advice: a frame of the film that shows the fault, the compass with the sector that is missing,
// the film as a bar with its playable parts, or the two moments of the loosest jump.
// @ts-check
import { element, svg } from "../app/element.js";
import { say } from "../app/words.js";
import { compassPicture } from "./compass.js";
import { disturbed } from "./disturbed.js";
import { framesOf } from "./instrument.js";

/** Headings that an advice finds missing: middle and half width, degrees; 0 is right, 90 down. */
const SECTORS = { lacks_right: [[0, 30]], lacks_left: [[180, 30]], lacks_level: [[0, 30], [180, 30]], lacks_up: [[-90, 60]], lacks_down: [[90, 60]] };
/** Side of a picture of the animal, px. */
const SIDE = 192;

/**
 * Returns the picture of an advice, or null if it has none.
 * @param {string} code @param {{desk: import("./instrument.js").Instrument, pictures: import("./pictures.js").Pictures, shoot: (shot: import("./shots.js").Shot) => HTMLElement}} parts
 */
export function pictureOf(code, { desk, pictures, shoot }) {
  const { columns: { value: columns }, facts: { value: facts }, first } = desk;
  const label = say("desk.advice.picture");
  const frameWith = (/** @type {(k: number) => boolean} */ isMeant) => { for (let k = first; k <= desk.last(); k++) if (isMeant(k)) return k; return first; };
  const sectors = /** @type {Record<string, number[][]>} */ (SECTORS)[code];
  if (sectors && facts?.stats.heading_histogram) return element("div.advice-compass", {}, compassPicture(facts.stats.heading_histogram, sectors));
  if (["little_playback", "no_transitions", "few_jumps"].includes(code) || code.startsWith("lacks_")) return playableBar(desk);
  if (code === "loose_jumps") return loosest(desk, pictures);
  if (code === "foreign_frames") return shoot({ frame: desk.frameOf(facts?.stats.first_foreign_s ?? 0), label });
  const { longest } = disturbed(code, facts?.stats.disturbances);
  if (longest) return shoot({ frame: desk.frameOf((longest.from_s + longest.to_s) / 2), label });
  if (code === "seldom_found") return shoot({ frame: frameWith((k) => !columns.detected[k]), label });
  if (code === "often_at_border") return shoot({ frame: frameWith((k) => columns.cut[k] === 1), label, hasMarks: true });
  if (code === "animal_too_small" || code === "several_animals" || code === "never_leaves" || code === "mostly_rests") return shoot({ frame: frameWith((k) => columns.detected[k] === 1), label, hasMarks: true });
  return null;
}

/** The film as a bar: where it can play on for ever. @param {import("./instrument.js").Instrument} desk */
function playableBar({ facts: { value: facts }, first, last }) {
  const { start = [], end = [] } = facts?.patches ?? {};
  const parts = [];
  // Patches that follow each other become one piece.
  for (let k = 0; k < start.length; k++) {
    const from = start[k];
    while (k + 1 < start.length && start[k + 1] === end[k]) k += 1;
    parts.push(`M${from} 0H${end[k]}V1H${from}Z`);
  }
  const picture = svg("svg", { viewBox: `${first} 0 ${last() + 1 - first} 1`, preserveAspectRatio: "none", role: "img", "aria-label": say("desk.advice.playable") }, svg("path", { d: parts.join("") }));
  return element("figure.playable", {}, picture, element("figcaption", {}, say("desk.advice.playable")));
}

/** The two moments of the jump with the greatest distance. @param {import("./instrument.js").Instrument} desk @param {import("./pictures.js").Pictures} pictures */
function loosest(desk, pictures) {
  const { facts: { value: facts } } = desk;
  const worst = facts?.jumps.at(-1);
  if (!worst) return null;
  const { from, to, mirrored } = framesOf(worst, facts?.clip_frames ?? 8);
  const pair = [0, 1].map(() => element("canvas", { width: SIDE, height: SIDE, role: "img", "aria-label": say("desk.advice.picture") }));
  void pictures.loaded.then(() => pictures.fill([{ frame: from, canvas: pair[0], mirrored: false }, { frame: to, canvas: pair[1], mirrored }]));
  return element("div.advice-pair", {}, ...pair);
}
