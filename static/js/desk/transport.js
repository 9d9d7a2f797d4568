// Buttons of the film, the reading of the moment in words, and the field that goes to a frame.
// @ts-check
import { element, svg } from "../app/element.js";
import { degrees, heading, percent, say } from "../app/words.js";
import { speedUnit, unitOf } from "./scale.js";

/** Speeds of playing. */
const RATES = [1, 0.5, 0.25, 0.1];

/** Shapes of the buttons, in a square of 24. */
const SHAPES = {
  start: "M6 5v14M19 5v14l-10-7z", back: "M17 5v14L7 12z", play: "M7 4v16l13-8z", pause: "M7 5v14M17 5v14", on: "M7 5v14l10-7z", end: "M18 5v14M5 5v14l10-7z",
  jump: "M3 18c2-12 14-14 17-3m0 0l-5-1m5 1l2-5",
};

/** The shape of the jump is a line, the others are filled. @param {keyof typeof SHAPES} name */
const icon = (name) => svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true", class: name === "jump" ? "icon-line" : "" }, svg("path", { d: SHAPES[name] }));

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, nextJump: () => void}} parts
 */
export function createTransport(desk, { player, nextJump }) {
  const { moment, life } = desk;
  const button = (/** @type {keyof typeof SHAPES} */ shape, /** @type {string} */ key, /** @type {() => void} */ act) => element("button.quiet.icon", { type: "button", title: say(key), "aria-label": say(key), onclick: act }, icon(shape));
  const play = button("play", "desk.play", player.toggle);
  player.isPlaying.watch((isPlaying) => {
    play.replaceChildren(icon(isPlaying ? "pause" : "play"));
    for (const name of ["title", "aria-label"]) play.setAttribute(name, say(isPlaying ? "desk.pause" : "desk.play"));
  }, life);
  const field = element("input#desk-frame", { type: "number", min: desk.first, step: 1, inputMode: "numeric", "aria-label": say("desk.frame") });
  field.addEventListener("change", () => { if (field.value !== "") { player.pause(); desk.goTo(field.valueAsNumber); field.value = String(moment.value); } });
  const of = element("span");
  const rate = element("select", { "aria-label": say("desk.rate"), onchange: () => player.setRate(Number(rate.value)) }, ...RATES.map((one) => element("option", { value: String(one) }, say("desk.times", { n: String(one) }))));
  const jump = button("jump", "desk.next_jump", nextJump);
  desk.facts.watch((facts) => { jump.disabled = !facts?.jumps.length; }, life);
  const reading = element("p.reading");
  const tell = () => {
    if (document.activeElement !== field) field.value = String(moment.value);
    field.max = String(desk.last());
    of.textContent = say("desk.of_frames", { n: desk.last() });
    reading.textContent = readingOf(desk, moment.value);
  };
  for (const seen of [moment, desk.columns, desk.isLoaded, desk.scale]) seen.watch(tell, life);
  const node = element("div.transport", {},
    element("div.buttons", {}, button("start", "desk.first", () => player.move(-Infinity)), button("back", "desk.back", () => player.move(-1)), play, button("on", "desk.on", () => player.move(1)), button("end", "desk.last", () => player.move(Infinity)), jump),
    element("label.go-to", {}, element("span", {}, say("desk.frame.short")), field, of), rate);
  return { node, reading, focusFrame: () => { field.focus(); field.select(); } };
}

/** Returns time, frame, heading, speed, bend and confidence of a frame as a sentence. @param {import("./instrument.js").Instrument} desk @param {number} k */
export function readingOf(desk, k) {
  const { columns: { value: columns } } = desk;
  const parts = [say("desk.at", { time: desk.timeOf(k).toFixed(2), frame: String(k) })];
  if (k >= columns.n) return [...parts, say("desk.reading.wait")].join(" · ");
  if (!columns.detected[k]) return [...parts, say("desk.not_seen")].join(" · ");
  parts.push(Number.isNaN(columns.heading_rad[k]) ? say("desk.no_heading") : say("desk.heading_is", { heading: heading(columns.heading_rad[k]) }));
  const unit = unitOf(desk);
  if (!Number.isNaN(columns.speed_px_per_s[k])) parts.push(say("desk.speed_is", { n: columns.speed_px_per_s[k] * unit.each, unit: speedUnit(unit) }));
  if (!Number.isNaN(columns.bend_rad[k])) parts.push(say("desk.bend_is", { n: String(Math.round(degrees(columns.bend_rad[k]))).replace("-", "−") }));
  if (!Number.isNaN(columns.head_confidence[k])) parts.push(say("desk.head_sure", { share: percent(columns.head_confidence[k]) }));
  if (!Number.isNaN(columns.confidence[k])) parts.push(say("desk.place_sure", { share: percent(columns.confidence[k]) }));
  return parts.join(" · ");
}
