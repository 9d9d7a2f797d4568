// The plots of the time axis: heading, speed, bend, tail beat, confidence. uPlot draws them where it was built, else they
// are drawn as SVG; both draw the same lines.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { frameAt } from "./columns.js";
import { thinned } from "./lines.js";
import { svgPlot } from "./plot-svg.js";
import { speedUnit, unitOf } from "./scale.js";
import { LEFT, RIGHT, ticksOf } from "./time-axis.js";

/**
 * @typedef {import("./columns.js").Columns} Columns
 * @typedef {import("./scale.js").Unit} Unit
 * @typedef {{values: (columns: Columns) => Float32Array, look: "sure" | "unsure" | "second", turn?: number}} Series
 * @typedef {{name: string, range: (columns: Columns, unit: Unit) => number[], dir: 1 | -1, ticks: (range: number[], unit: Unit) => [number, string][], series: Series[]}} Plot
 *   dir -1: greater values are lower
 * @typedef {{lines: import("./lines.js").Line[], span: number[], range: number[], sides: [number, string][], ticks: number[], width: number}} Drawing sides: values at the side of the plot
 * @typedef {{node: HTMLElement, draw: (drawing: Drawing) => void}} Plotter
 */

const degrees = (/** @type {number} */ n) => `${n}°`;
/** @type {Plot[]} */
const PLOTS = [
  { name: "heading", range: () => [-180, 180], dir: -1, ticks: () => [[-180, say("desk.side.left")], [-90, say("desk.side.up")], [0, say("desk.side.right")], [90, say("desk.side.down")], [180, say("desk.side.left")]],
    series: [{ values: (columns) => columns.unsure_deg, look: "unsure", turn: 360 }, { values: (columns) => columns.sure_deg, look: "sure", turn: 360 }] },
  { name: "speed", range: (columns, { each }) => [0, rounded(columns.mostSpeed * each) / each], dir: 1,
    ticks: ([, most], { each }) => [0, most / 2, most].map((value) => [value, String(Number((value * each).toPrecision(4)))]),
    series: [{ values: (columns) => columns.speed_px_per_s, look: "sure" }] },
  { name: "bend", range: (columns) => { const most = Math.min(Math.PI, Math.max(0.35, columns.mostBend)); return [-most, most]; }, dir: 1,
    ticks: ([, most]) => [[-most, degrees(-Math.round((most * 180) / Math.PI))], [0, "0°"], [most, degrees(Math.round((most * 180) / Math.PI))]],
    series: [{ values: (columns) => columns.bend_rad, look: "sure" }] },
  { name: "tail_beat", range: (columns) => [0, rounded(columns.mostBeat)], dir: 1, ticks: ([, most]) => [[0, "0"], [most, String(most)]],
    series: [{ values: (columns) => columns.tail_beat_hz, look: "sure" }] },
  { name: "confidence", range: () => [0.5, 1], dir: 1, ticks: () => [[0.5, "50 %"], [1, "100 %"]],
    series: [{ values: (columns) => columns.head_confidence, look: "second" }, { values: (columns) => columns.confidence, look: "sure" }] },
];

/** Returns the next round number. @param {number} most */
function rounded(most) {
  const power = 10 ** Math.floor(Math.log10(most || 1));
  return [1, 2, 4, 6, 10].map((one) => one * power).find((one) => one >= most) ?? 1;
}

/** @param {import("./instrument.js").Instrument} desk */
export function createPlots(desk) {
  const rows = PLOTS.map((plot) => ({ plot, range: [0, 1], plotter: svgPlot(plot), title: element("p.plot-title"), node: element("div.plot", { className: `plot plot-${plot.name}` }) }));
  const key = element("p.plot-key", {}, element("span.line-sure", {}, say("desk.key.sure")), element("span.line-unsure", {}, say("desk.key.unsure")));
  for (const { node, title, plotter } of rows) node.append(title, plotter.node);
  rows[0].node.prepend(key);
  let isAsked = false;
  let isReady = false;
  const ask = () => {
    if (!isAsked && isReady) requestAnimationFrame(draw);
    isAsked = isReady;
  };
  const draw = () => {
    isAsked = false;
    if (desk.life.aborted) return;
    const columns = desk.columns.value;
    const [from_s, to_s] = desk.span.value;
    const width = rows[0].node.clientWidth - LEFT - RIGHT;
    if (width < 10) return;
    const frames = { from: Math.max(0, frameAt(columns, from_s) - 1), to: Math.min(columns.n, frameAt(columns, to_s) + 2), most: 4 * width };
    const { ticks } = ticksOf(desk.span.value, width);
    for (const { plot, plotter, range, node } of rows) {
      const lines = plot.series.map(({ values, turn }) => thinned(columns.time_s, values(columns), { ...frames, turn }));
      node.hidden = desk.isLoaded.value && ((plot.name === "bend" && !columns.hasMidline) || (plot.name === "tail_beat" && !columns.mostBeat));
      if (!node.hidden) plotter.draw({ lines, span: [from_s, to_s], range, sides: plot.ticks(range, unitOf(desk)), ticks, width });
    }
  };
  const fit = () => {
    for (const row of rows) {
      row.range = row.plot.range(desk.columns.value, unitOf(desk));
      row.title.textContent = say(`desk.plot.${row.plot.name}`, { unit: speedUnit(unitOf(desk)) });
    }
    ask();
  };
  desk.columns.watch(fit, desk.life);
  desk.scale.watch(fit, desk.life);
  desk.isLoaded.watch(ask, desk.life);
  desk.span.watch(ask, desk.life);
  const observer = new ResizeObserver(ask);
  observer.observe(rows[0].node);
  desk.life.addEventListener("abort", () => observer.disconnect());
  addEventListener("theme", ask, { signal: desk.life });

  // Nothing is drawn twice: the plots wait for the answer whether uPlot was built.
  import("./plot-uplot.js").then(({ loadUplot }) => loadUplot()).catch(() => null).then((uplot) => {
    if (desk.life.aborted) return;
    for (const row of rows) {
      const better = uplot?.(row.plot, desk.life);
      if (!better) break;
      row.plotter.node.replaceWith(better.node);
      row.plotter = better;
    }
    isReady = true;
    ask();
  });
  return rows.map(({ node }) => node);
}
