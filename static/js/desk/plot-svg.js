// One plot as SVG, drawn by the page itself.
// @ts-check
import { element, svg } from "../app/element.js";
import { svgPen, trace } from "./lines.js";

/** @param {import("./plots.js").Plot} plot @returns {import("./plots.js").Plotter} */
export function svgPlot(plot) {
  const grid = svg("path", { class: "grid" });
  const paths = plot.series.map(({ look }) => svg("path", { class: `line ${look}` }));
  const picture = svg("svg", { "aria-hidden": "true", preserveAspectRatio: "none" }, grid, ...paths);
  const labels = element("div.plot-labels", { "aria-hidden": "true" });
  const node = element("div.plot-box", {}, labels, picture);
  return {
    node,
    draw({ lines, span, range, sides, ticks, width }) {
      const height = picture.clientHeight || 1;
      picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
      const xOf = (/** @type {number} */ time_s) => ((time_s - span[0]) / (span[1] - span[0])) * width;
      const yOf = (/** @type {number} */ value) => {
        const share = (value - range[0]) / (range[1] - range[0]);
        return 1 + (plot.dir > 0 ? 1 - share : share) * (height - 2);
      };
      grid.setAttribute("d", [...sides.map(([value]) => `M0 ${yOf(value).toFixed(1)}H${width}`), ...ticks.map((time_s) => `M${xOf(time_s).toFixed(1)} 0V${height}`)].join(""));
      lines.forEach((line, idx) => {
        const pen = svgPen();
        trace(line, pen, xOf, yOf);
        paths[idx].setAttribute("d", pen.path());
      });
      labels.replaceChildren(...sides.map(([value, text]) => {
        const label = element("span", {}, text);
        label.style.top = `${(100 * yOf(value)) / height}%`;
        return label;
      }));
    },
  };
}
