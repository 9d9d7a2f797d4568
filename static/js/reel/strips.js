// The order of the flock over time: agreement of headings, circling and nearest neighbor on one axis with one cursor.
// @ts-check
import { element, svg } from "../app/element.js";
import { clock, count, language, say } from "../app/words.js";

/** Points of a line, and rows of the table. */
const POINTS = 600;
const ROWS = 24;
const HEIGHT = 100;
/** Room above and below a line. */
const EDGE = 6;

/** Quantities with the most of their axis; null fits the axis to the values. */
/** @type {{name: Api.FlockFigure, most: number | null}[]} */
const SERIES = [{ name: "polarization", most: 1 }, { name: "milling", most: 1 }, { name: "nearest_neighbor_bl", most: null }];

/** Returns the quantities that a plan tells for each frame. @param {import("../flock/plan.js").Plan} plan */
export function seriesOf({ head: { stats }, nFrames, nIndividuals }) {
  const told = stats?.per_frame ?? {};
  return SERIES.flatMap(({ name, most }) => {
    const values = told[name];
    if (nIndividuals < 2 || values?.length !== nFrames || !values.every(Number.isFinite)) return [];
    const mean = stats[name] ?? values.reduce((a, b) => a + b, 0) / values.length;
    return [{ name, values, mean, most: most ?? roundUp(Math.max(...thin(values, POINTS))) }];
  });
}

/** Returns the largest of each of at most `n` even pieces, so that no peak is lost. @param {number[]} values @param {number} n */
export function thin(values, n) {
  if (values.length <= n) return values;
  return Array.from({ length: n }, (_, k) => {
    let most = -Infinity;
    for (let t = Math.floor((k * values.length) / n); t < Math.floor(((k + 1) * values.length) / n); t++) most = Math.max(most, values[t]);
    return most;
  });
}

/** Returns the next of 1, 2, 5, 10, 20 ... @param {number} value */
export function roundUp(value) {
  if (!(value > 0)) return 1;
  const ten = 10 ** Math.floor(Math.log10(value));
  return (/** @type {number} */ ([1, 2, 5, 10].find((step) => step * ten >= value * 0.9999))) * ten;
}

const exact = new Intl.NumberFormat(language, { minimumFractionDigits: 2, maximumFractionDigits: 2 });
const told = (/** @type {number} */ value) => exact.format(value);

/**
 * @param {import("../flock/plan.js").Plan} plan @param {{seek: (frame: number) => void}} options
 * @returns {{node: HTMLElement, setFrame: (frame: number) => void} | null} null for one animal
 */
export function strips(plan, { seek }) {
  const all = seriesOf(plan);
  if (!all.length) return null;
  const last = Math.max(1, plan.nFrames - 1);
  const rows = all.map((series) => row(series, { last, seek }));
  const table = element("table");
  const details = element("details", { ontoggle: () => { if (details.open && !table.childElementCount) table.append(...tableOf(plan, all)); } },
    element("summary", {}, say("timeline.table")), element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("reel.strips") }, table));
  return {
    node: element("section.strips", { "aria-label": say("reel.strips") }, ...rows.map((one) => one.node), details),
    setFrame(frame) { for (const one of rows) one.setFrame(frame); },
  };
}

/** @param {{name: string, values: number[], mean: number, most: number}} series @param {{last: number, seek: (frame: number) => void}} axis */
function row({ name, values, mean, most }, { last, seek }) {
  const y = (/** @type {number} */ value) => HEIGHT - EDGE - ((HEIGHT - 2 * EDGE) * Math.min(most, value)) / most;
  const shown = thin(values, POINTS);
  const points = shown.map((value, k) => `${((k / Math.max(1, shown.length - 1)) * POINTS).toFixed(1)},${y(value).toFixed(1)}`).join(" ");
  const now = svg("line", { class: "now", y1: 0, y2: HEIGHT });
  const plot = svg("svg", { viewBox: `0 0 ${POINTS} ${HEIGHT}`, preserveAspectRatio: "none", "aria-hidden": "true" },
    svg("line", { class: "mean", x1: 0, x2: POINTS, y1: y(mean), y2: y(mean) }), svg("polyline", { class: "series", points }), now);
  const value = element("output", { "aria-live": "off" });
  const at = (/** @type {PointerEvent} */ event) => {
    const box = plot.getBoundingClientRect();
    seek(Math.round(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * last));
  };
  plot.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => { plot.setPointerCapture(event.pointerId); at(event); });
  plot.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => { if (plot.hasPointerCapture(event.pointerId)) at(event); });
  const means = say("reel.strip.means", { mean: told(mean), most: count(most) });
  return {
    node: element("figure.reel-strip", {}, element("figcaption", {}, element("strong", {}, say(`reel.strip.${name}`)), " ", element("small", {}, say(`reel.strip.${name}.help`), " ", means)), plot, value),
    setFrame(/** @type {number} */ frame) {
      for (const end of ["x1", "x2"]) now.setAttribute(end, String((frame / last) * POINTS));
      value.textContent = say("reel.strip.now", { value: told(values[frame] ?? 0) });
    },
  };
}

/** @param {import("../flock/plan.js").Plan} plan @param {{name: string, values: number[]}[]} all */
function tableOf({ nFrames, fps }, all) {
  const n_rows = Math.min(ROWS, nFrames);
  const frames = Array.from({ length: n_rows }, (_, k) => Math.round((k / Math.max(1, n_rows - 1)) * (nFrames - 1)));
  const heads = [say("timeline.time"), say("reel.frame"), ...all.map(({ name }) => say(`reel.strip.${name}`))];
  return [element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))),
    element("tbody", {}, ...frames.map((t) => element("tr", {}, ...[clock(t / fps), String(t), ...all.map(({ values }) => told(values[t]))].map((text) => element("td", {}, text)))))];
}
