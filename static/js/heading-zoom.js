// The zooming plot of the heading, drawn by uPlot. Dragging zooms in, double-clicking zooms out. The static
// drawing stays if uPlot was not built (`make vendor`), without a mouse, or on a narrow screen.
// @ts-check
import { byId, element } from "./element.js";
import { headingPoints } from "./heading-series.js";
import { seconds } from "./words.js";

const SIDES = [[-180, "← left"], [-90, "↑ up"], [0, "→ right"], [90, "↓ down"], [180, "← left"]];

/**
 * @param {any} poses @param {(frame: number) => void} onFrame receives the frame under the pointer
 * @returns {Promise<((frame: number) => void) | null>} moves the cursor to a frame; null without the plot
 */
export async function zoomingPlot(poses, onFrame) {
  if (!matchMedia("(pointer: fine) and (min-width: 40rem)").matches) return null;
  const library = await import("/vendor/uplot.js").catch(() => null);
  if (!library) return null;
  await styled("/vendor/uplot.css");
  const place = element("div", { className: "heading-zoom" });
  byId("heading-plot").replaceChildren(place);
  const data = columns(poses);
  const plot = new library.default(options(place, data), [data.time_s, data.sure, data.unsure], place);
  place.addEventListener("pointermove", () => { if (plot.cursor.idx !== null) onFrame(data.frames[plot.cursor.idx]); });
  new ResizeObserver(() => plot.setSize(sizeOf(place))).observe(place);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plot.redraw());
  return (frame) => plot.setCursor({ left: plot.valToPos(poses.frames[frame].time_s, "x"), top: 0 }, false);
}

const sizeOf = (place) => ({ width: place.clientWidth, height: place.clientHeight });

/** Returns the points as columns. null breaks a line; `cuts_s` are the times of crossings at 180 degrees. */
function columns(poses) {
  const data = { frames: [], time_s: [], sure: [], unsure: [], cuts_s: [] };
  const points = headingPoints(poses, poses.frames.length);
  points.forEach((point, index) => {
    const previous = points[index - 1];
    const frame = (point ?? previous)?.x ?? index;
    const time_s = poses.frames[Math.floor(frame)].time_s;
    if (!point && Math.abs(previous?.y ?? 0) === 180) data.cuts_s.push(time_s);
    data.frames.push(Math.floor(frame));
    data.time_s.push(time_s);
    data.sure.push(point?.sure ? point.y : null);
    data.unsure.push(point && (!point.sure || previous?.sure === false) ? point.y : null);
  });
  return data;
}

function options(place, { cuts_s }) {
  const style = getComputedStyle(byId("heading"));
  const soft = () => style.color;
  const axis = { stroke: soft, grid: { stroke: () => style.outlineColor, width: 1 }, ticks: { show: false }, font: "13px system-ui, sans-serif" };
  // uPlot connects points in the same pixel column. Explicit gaps keep the crossings open.
  const gaps = (plot, series, first, last, nulls) => [...nulls, ...cuts_s.map((cut_s) => {
    const at = plot.valToPos(cut_s, "x", true);
    return [at - 2, at + 3];
  })].sort((a, b) => a[0] - b[0]);
  const line = { width: 1.6, points: { show: false }, gaps };
  return {
    ...sizeOf(place),
    legend: { show: false },
    padding: [8, 12, 0, 0],
    cursor: { y: false, points: { show: false } },
    scales: { x: { time: false }, y: { range: [-180, 180], dir: -1 } },
    axes: [
      { ...axis, size: 28, values: (_, times) => times.map(seconds) },
      { ...axis, size: 62, gap: 4, splits: () => SIDES.map(([y]) => y), values: () => SIDES.map(([, text]) => text) },
    ],
    series: [{}, { ...line, stroke: () => style.accentColor }, { ...line, stroke: soft, dash: [2, 3] }],
  };
}

/** Loads a style sheet once and waits for it. */
function styled(href) {
  if (document.querySelector(`link[href="${href}"]`)) return undefined;
  return new Promise((resolve) => document.head.append(element("link", { rel: "stylesheet", href, onload: resolve, onerror: resolve })));
}
