// One plot drawn by uPlot, which was built into /vendor by `make vendor`. The lines are drawn as they are given:
// uPlot's own paths join points that share a pixel column, across gaps.
// @ts-check
import { element } from "../app/element.js";
import { styled } from "../app/router.js";
import { colorsAt } from "./canvas.js";
import { trace } from "./lines.js";
import { LEFT, RIGHT } from "./time-axis.js";

/** @typedef {import("/vendor/uplot.js")} Chart */

/** Returns the function that makes plots, or null if uPlot was not built. */
export async function loadUplot() {
  const library = await import("/vendor/uplot.js").catch(() => null);
  if (!library) return null;
  await styled("/vendor/uplot.css");
  return (/** @type {import("./plots.js").Plot} */ plot, /** @type {AbortSignal} */ life) => uplot(library.default, plot, life);
}

/** @param {typeof import("/vendor/uplot.js")} UPlot @param {import("./plots.js").Plot} plot @param {AbortSignal} life @returns {import("./plots.js").Plotter} */
function uplot(UPlot, plot, life) {
  const node = element("div.plot-box.plot-uplot", { "aria-hidden": "true" });
  /** @type {import("./plots.js").Drawing} */
  let drawing = { lines: [], span: [0, 1], range: [0, 1], sides: [], ticks: [], width: 1 };
  /** @type {Record<string, string>} */
  let colors = {};
  const pathsOf = (/** @type {Chart} */ u, /** @type {number} */ idx) => {
    const stroke = new Path2D();
    if (drawing.lines[idx - 1]) trace(drawing.lines[idx - 1], stroke, (x) => u.valToPos(x, "x", true), (y) => u.valToPos(y, "y", true));
    return { stroke, fill: null, clip: null, flags: 0 };
  };
  const looks = {
    sure: { stroke: () => colors.accent, width: 1.6 },
    unsure: { stroke: () => colors["line-strong"], width: 1.6, dash: [2, 3] },
    second: { stroke: () => colors.water, width: 1.3 },
  };
  const axis = { stroke: () => colors["ink-soft"], grid: { stroke: () => colors.line, width: 1 }, ticks: { show: false }, font: "12px system-ui, sans-serif" };
  /** @type {import("/vendor/uplot.js").Options} */
  const options = {
    width: 100, height: 50, legend: { show: false }, padding: [8, RIGHT, 8, 0],
    cursor: { show: false, drag: { x: false, y: false } }, select: { show: false, left: 0, top: 0, width: 0, height: 0 },
    scales: { x: { time: false, range: () => /** @type {[number, number]} */ (drawing.span) }, y: { range: () => /** @type {[number, number]} */ (drawing.range), dir: plot.dir } },
    axes: [
      { ...axis, size: 0, values: () => [], splits: () => drawing.ticks },
      { ...axis, size: LEFT, gap: 4, splits: () => drawing.sides.map(([value]) => value), values: () => drawing.sides.map(([, text]) => text) },
    ],
    series: [{}, ...plot.series.map(({ look }) => ({ ...looks[look], points: { show: false }, paths: pathsOf }))],
  };
  /** @type {Chart | null} */
  let made = null;
  life.addEventListener("abort", () => made?.destroy());
  return {
    node,
    draw(next) {
      drawing = next;
      colors = colorsAt(node);
      const size = { width: node.clientWidth, height: node.clientHeight };
      /** @type {import("/vendor/uplot.js").AlignedData} */
      const data = [drawing.span, ...plot.series.map(() => drawing.range.slice(0, 2))];
      made ??= new UPlot(options, data, node);
      if (made.width !== size.width || made.height !== size.height) made.setSize(size);
      made.setData(data, false);
      // Scales may be the same as before, with other lines.
      made.redraw(true, true);
    },
  };
}
