// Figure 7.2 of the second paper around the moment: patches as arrows along time, jumps into the future as arcs above
// them, jumps into the past as arcs below. A click goes to a frame.
// @ts-check
import { say } from "../app/words.js";
import { drawnCanvas } from "./canvas.js";
import { lowerBound, patchAt } from "./patch-graph.js";

/** Time that is shown, s, and most arcs that are drawn. */
const [SPAN_S, MOST] = [2.4, 600];
/** Room for the labels, px, and half of the thickness of an arrow. */
const [LABELS, HALF] = [18, 5];
/** Least width of a patch in which its number is written, px. */
const NUMBERED = 26;

/** @param {import("./instrument.js").Instrument} desk @param {{player: import("./player.js").Player}} parts */
export function createMap(desk, { player }) {
  const { life, moment, facts, library } = desk;
  const { canvas, ask } = drawnCanvas(life, draw, { className: "patch-map", "aria-label": say("desk.patch.map.label") });
  const windowOf = () => {
    const length = Math.min(desk.end_s - desk.start_s, SPAN_S) * library.fps;
    const from = Math.min(Math.max(desk.first, moment.value + 0.5 - length / 2), Math.max(desk.first, desk.last() + 1 - length));
    return { from, length };
  };

  /** @param {import("./canvas.js").Paper} paper */
  function draw({ context, width, height, colors }) {
    const found = facts.value;
    if (!found) return;
    const { from, length } = windowOf();
    const xOf = (/** @type {number} */ frame) => ((frame - from) / length) * width;
    const middle = (height - LABELS) / 2;
    const current = patchAt(found.patches, moment.value);
    drawLeaps(context, found, { from, length, xOf, middle, current, colors });
    const { start, end } = found.patches;
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    for (let k = Math.max(0, lowerBound(start, from) - 1); k < start.length && start[k] < from + length; k++) {
      const [a, b] = [xOf(start[k]) + 1, xOf(end[k]) - 1];
      const tip = Math.min(6, (b - a) / 2);
      context.fillStyle = k === current ? colors.accent : colors["line-strong"];
      context.beginPath();
      context.moveTo(a, middle - HALF);
      context.lineTo(b - tip, middle - HALF);
      context.lineTo(b, middle);
      context.lineTo(b - tip, middle + HALF);
      context.lineTo(a, middle + HALF);
      context.fill();
      context.fillStyle = k === current ? colors.ink : colors["ink-soft"];
      if (b - a >= NUMBERED || k === current) context.fillText(String(k), Math.min(width - 14, Math.max(14, (a + b) / 2)), height - 4);
    }
    context.fillStyle = colors.ink;
    context.fillRect(xOf(moment.value + 0.5) - 1, 0, 2, height - LABELS);
  }

  /**
   * Draws the jumps of the window; those of the patch of the moment are strong.
   * @param {CanvasRenderingContext2D} context @param {import("./instrument.js").Facts} facts
   * @param {{from: number, length: number, xOf: (frame: number) => number, middle: number, current: number, colors: Record<string, string>}} look
   */
  function drawLeaps(context, { leaps, patches }, { from, length, xOf, middle, current, colors }) {
    const last = current < 0 ? -1 : patches.end[current] - 1;
    const begin = lowerBound(leaps.from, Math.floor(from));
    const strong = [];
    for (let k = begin, n = 0; k < leaps.from.length && leaps.from[k] < from + length && n < MOST; k++) {
      if (leaps.mirrored[k] && !desk.showsMirrored.value) continue;
      n += 1;
      if (leaps.from[k] === last) strong.push(k);
      else arc(context, k, false);
    }
    for (const k of strong) arc(context, k, true);
    context.globalAlpha = 1;
    context.setLineDash([]);

    function arc(/** @type {CanvasRenderingContext2D} */ pen, /** @type {number} */ k, /** @type {boolean} */ isStrong) {
      // From the end of a frame to the start of another.
      const [a, b] = [xOf(leaps.from[k] + 1), xOf(leaps.to[k])];
      const side = b > a ? -1 : 1;
      const half = Math.abs(b - a) / 2;
      const tall = Math.min(middle - HALF - 4, 8 + Math.sqrt(half) * 4);
      pen.globalAlpha = isStrong ? 1 : 0.3;
      pen.lineWidth = isStrong ? 2 : 1;
      pen.strokeStyle = leaps.mirrored[k] ? colors.water : colors.accent;
      pen.setLineDash(leaps.mirrored[k] ? [5, 3] : []);
      pen.beginPath();
      pen.ellipse((a + b) / 2, middle + side * HALF, half, tall, 0, 0, Math.PI, side < 0);
      pen.stroke();
      if (!isStrong) return;
      pen.setLineDash([]);
      pen.beginPath();
      pen.moveTo(b - 4, middle + side * (HALF + 8));
      pen.lineTo(b, middle + side * (HALF + 1));
      pen.lineTo(b + 4, middle + side * (HALF + 8));
      pen.stroke();
    }
  }

  canvas.addEventListener("click", (event) => {
    const box = canvas.getBoundingClientRect();
    const { from, length } = windowOf();
    player.pause();
    desk.goTo(Math.floor(from + ((event.clientX - box.left) / box.width) * length));
  }, { signal: life });
  for (const seen of [moment, facts, desk.showsMirrored, desk.isLoaded]) seen.watch(ask, life);
  return { node: canvas, ask };
}
