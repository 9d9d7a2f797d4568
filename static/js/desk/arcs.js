// The last row of the time axis: its labels, and the jumps as arcs that hang from it (plain orange, mirrored blue
// and dashed). Jumps near the moment are stronger.
// @ts-check
import { say } from "../app/words.js";
import { drawnCanvas } from "./canvas.js";
import { framesOf } from "./instrument.js";
import { shownJumps } from "./jumps.js";
import { LEFT, RIGHT, ticksOf, tickWords } from "./time-axis.js";

/** Most arcs that are drawn, the best first, and height of the labels, px. */
const MOST = 300;
const LABELS = 22;
/** Jumps that begin or end this near to the moment are strong, s. */
const NEAR_S = 0.25;

/** @param {import("./instrument.js").Instrument} desk @returns {HTMLElement} */
export function createArcs(desk) {
  const { life, span, moment, facts, library, end_s } = desk;
  const { canvas, ask } = drawnCanvas(life, draw, { className: "arcs", "aria-label": say("desk.arcs") });

  /** @param {import("./canvas.js").Paper} paper */
  function draw({ context, width, height, colors }) {
    const [from, to] = span.value;
    const plot = width - LEFT - RIGHT;
    const xOf = (/** @type {number} */ time_s) => LEFT + ((time_s - from) / (to - from)) * plot;
    const { ticks, step } = ticksOf(span.value, plot);
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = colors["ink-soft"];
    context.textAlign = "center";
    for (const time_s of ticks) {
      const text = tickWords(time_s, step, end_s);
      const half = context.measureText(text).width / 2;
      context.fillText(text, Math.min(width - half, Math.max(half, xOf(time_s))), 15);
    }
    context.fillStyle = colors.line;
    context.fillRect(LEFT, LABELS, plot, 1);
    context.beginPath();
    context.rect(LEFT, LABELS, plot, height);
    context.clip();
    const now_s = (moment.value + 0.5) / library.fps;
    for (const one of chosen().reverse()) {
      const [a, b] = [one.from, one.to].map((frame) => (frame + 0.5) / library.fps).sort((p, q) => p - q);
      if (b < from || a > to) continue;
      const isNear = Math.min(Math.abs(a - now_s), Math.abs(b - now_s)) < NEAR_S;
      const [x, half] = [xOf((a + b) / 2), ((b - a) / (to - from)) * plot / 2];
      context.globalAlpha = isNear ? 1 : 0.35;
      context.lineWidth = isNear ? 2 : 1.2;
      context.strokeStyle = one.mirrored ? colors.water : colors.accent;
      context.setLineDash(one.mirrored ? [5, 3] : []);
      context.beginPath();
      context.ellipse(x, LABELS, half, Math.min(height - LABELS - 3, 8 + (height - LABELS - 11) * Math.sqrt((2 * half) / plot)), 0, 0, Math.PI);
      context.stroke();
    }
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  /** Returns the jumps to draw, the best first. */
  function chosen() {
    return shownJumps(facts.value, desk.showsMirrored.value).slice(0, MOST).map((one) => framesOf(one, facts.value?.clip_frames ?? 8));
  }
  for (const seen of [span, moment, facts, desk.showsMirrored]) seen.watch(ask, life);
  return canvas;
}
