// The plan as asked against shown, as figures 7.3 to 7.6 of the second paper draw it: the heading of one boid over time,
// the heading of the animal that is drawn for it, and below them the patches that were put together for it.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { clock, count, say } from "../app/words.js";
import { problemBox } from "../parts/problem.js";
import { piecesOf, turnsOf } from "./pieces.js";

/** Room left of the plot for its labels, height of the plot and of the row of pieces, px. */
const [LEFT, TALL, ROW] = [64, 180, 26];
/** Rows of the table, and least width in which a piece has words, px. */
const [ROWS, WORDS] = [40, 58];
const SIDES = [[-180, "left"], [-90, "up"], [0, "right"], [90, "down"], [180, "left"]];
/** Names of the tokens that the plot is drawn with. */
const TOKENS = ["ink", "ink-soft", "line", "accent", "water", "sunken"];

/**
 * Returns a part that opens, loads flock.json when it does, and follows the moment of the reel.
 * @param {Api.Flock} flock @param {{seek: (frame: number) => void, life: AbortSignal}} options
 */
export function askedAndShown(flock, { seek, life }) {
  const box = element("div.asked-box");
  let frame = 0;
  /** @type {ReturnType<typeof plotOf> | null} */
  let plot = null;
  let isAsked = false;
  const open = async () => {
    if (!node.open || isAsked) return;
    isAsked = true;
    box.replaceChildren(element("p.soft", {}, say("reel.asked.loading")));
    try {
      plot = plotOf(await get(`/v1/flocks/${flock.id}/flock.json`, life), { seek, life });
      box.replaceChildren(plot.node);
      plot.setFrame(frame);
    } catch (problem) {
      isAsked = false;
      if (!life.aborted) box.replaceChildren(problemBox(problem));
    }
  };
  const node = element("details.asked", { ontoggle: open }, element("summary", {}, say("reel.asked")), element("p.soft", {}, say("reel.asked.help")), box);
  return { node, setFrame(/** @type {number} */ now) { frame = now; plot?.setFrame(now); } };
}

/** @param {Api.FlockFile} made flock.json @param {{seek: (frame: number) => void, life: AbortSignal}} options */
function plotOf({ individuals, fps }, { seek, life }) {
  const canvas = element("canvas.asked-plot", { role: "img", "aria-label": say("reel.asked.label") });
  const words = element("p.asked-words");
  const table = element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("reel.asked.pieces") });
  const choose = element("select", { onchange: () => take() }, ...individuals.map((one) => element("option", { value: String(one.id) }, say("reel.asked.animal", { id: String(one.id) }))));
  const last = () => Math.max(1, one.heading_rad.length);
  let one = individuals[0];
  let pieces = piecesOf(one);
  let now = 0;
  let isDue = false;
  const ask = () => { if (!isDue) { isDue = true; requestAnimationFrame(draw); } };
  function take() {
    one = individuals[choose.selectedIndex];
    pieces = piecesOf(one);
    table.replaceChildren(tableOf(pieces, fps));
    tell();
  }
  function tell() {
    const piece = pieces.find(({ at, n }) => now < at + n);
    const gap = Math.abs(turnsOf(one.heading_rad[now] - one.boid.heading_rad[now]));
    if (piece) words.textContent = say("reel.asked.now", { frame: String(now), source: String(one.source_frame[now]), gap: String(Math.round(gap)), how: say(piece.mirrored ? "reel.asked.mirrored" : "reel.asked.plain") });
    ask();
  }
  function draw() {
    isDue = false;
    const wide = canvas.clientWidth;
    if (!wide || life.aborted) return;
    const ratio = Math.min(3, devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(wide * ratio), Math.round((TALL + ROW + 22) * ratio)];
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const probe = getComputedStyle(canvas);
    /** @type {Record<string, string>} */
    const colors = {};
    for (const name of TOKENS) { canvas.style.outlineColor = `var(--${name})`; colors[name] = probe.outlineColor; }
    pen.scale(ratio, ratio);
    const xOf = (/** @type {number} */ t) => LEFT + (t / last()) * (wide - LEFT - 4);
    const yOf = (/** @type {number} */ degrees) => 6 + ((degrees + 180) / 360) * (TALL - 12);
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "end";
    for (const [degrees, side] of /** @type {[number, string][]} */ (SIDES)) {
      pen.fillStyle = colors.line;
      pen.fillRect(LEFT, yOf(degrees), wide - LEFT - 4, 1);
      pen.fillStyle = colors["ink-soft"];
      pen.fillText(say(`desk.side.${side}`), LEFT - 6, yOf(degrees) + 4);
    }
    for (const { at, n, mirrored, from } of pieces) {
      const [a, b] = [xOf(at), xOf(at + n)];
      pen.fillStyle = colors.line;
      pen.fillRect(b - 0.5, 0, 1, TALL + ROW);
      pen.fillStyle = now >= at && now < at + n ? colors.ink : mirrored ? colors.water : colors.accent;
      pen.globalAlpha = now >= at && now < at + n ? 0.85 : 0.4;
      pen.fillRect(a + 1, TALL + 5, Math.max(1, b - a - 2), 6);
      pen.globalAlpha = 1;
      pen.fillStyle = colors["ink-soft"];
      pen.textAlign = "start";
      if (b - a > WORDS) pen.fillText(`${(from / fps).toFixed(1)} s`, a + 2, TALL + 24);
    }
    line(one.boid.heading_rad, colors.water, 4, 0.55);
    line(one.heading_rad, colors.accent, 1.75, 1);
    pen.textAlign = "center";
    pen.fillStyle = colors["ink-soft"];
    for (const share of [0, 0.25, 0.5, 0.75, 1]) pen.fillText(clock((share * last()) / fps), Math.min(wide - 16, xOf(share * last())), TALL + ROW + 18);
    pen.fillStyle = colors.ink;
    pen.fillRect(xOf(now + 0.5) - 1, 0, 2, TALL + ROW);
    /** @param {number[]} headings @param {string} color @param {number} thick @param {number} alpha */
    function line(headings, color, thick, alpha) {
      pen.strokeStyle = color;
      [pen.lineWidth, pen.globalAlpha, pen.lineJoin] = [thick, alpha, "round"];
      pen.beginPath();
      headings.forEach((rad, t) => {
        const isCut = t === 0 || Math.abs(rad - headings[t - 1]) > Math.PI;
        pen[isCut ? "moveTo" : "lineTo"](xOf(t + 0.5), yOf((rad * 180) / Math.PI));
      });
      pen.stroke();
      pen.globalAlpha = 1;
    }
  }
  const at = (/** @type {PointerEvent} */ event) => {
    const box = canvas.getBoundingClientRect();
    seek(Math.min(last() - 1, Math.max(0, Math.floor(((event.clientX - box.left - LEFT) / (box.width - LEFT - 4)) * last()))));
  };
  canvas.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => { canvas.setPointerCapture(event.pointerId); at(event); }, { signal: life });
  canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => { if (canvas.hasPointerCapture(event.pointerId)) at(event); }, { signal: life });
  const observer = new ResizeObserver(ask);
  observer.observe(canvas);
  addEventListener("theme", ask, { signal: life });
  life.addEventListener("abort", () => observer.disconnect());
  take();
  const key = element("p.asked-key", {}, element("label", {}, element("span.unseen", {}, say("reel.asked.choose")), choose), element("span.key-asked", {}, say("reel.asked.boid")), element("span.key-shown", {}, say("reel.asked.shown")));
  const node = element("div", {}, key, canvas, words, element("details", {}, element("summary", {}, say("reel.asked.pieces")), table));
  return { node, setFrame(/** @type {number} */ frame) { now = Math.min(last() - 1, frame); tell(); } };
}

/** Returns the pieces as a table. @param {ReturnType<typeof piecesOf>} pieces @param {number} fps */
function tableOf(pieces, fps) {
  const heads = ["at", "source", "length", "kind", "gap"].map((name) => element("th", { scope: "col" }, say(`reel.asked.column.${name}`)));
  const rows = pieces.slice(0, ROWS).map(({ at, n, from, mirrored, gap_deg }) => element("tr", {}, ...[(at / fps).toFixed(2), `${(from / fps).toFixed(2)}–${((from + n - 1) / fps).toFixed(2)}`, count(n), say(mirrored ? "reel.asked.mirrored" : "reel.asked.plain"), `${Math.round(gap_deg)}°`].map((text) => element("td", {}, text))));
  return element("table", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows));
}
