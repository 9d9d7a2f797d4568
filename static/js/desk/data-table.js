// The plots as a table: the shown part of the film in even steps, made when it is opened.
// @ts-check
import { element } from "../app/element.js";
import { count, heading, percent, say } from "../app/words.js";
import { frameAt } from "./columns.js";
import { speedUnit, unitOf } from "./scale.js";

/** Rows of the table. */
const ROWS = 24;
const NAMES = ["time", "frame", "heading", "speed", "bend", "confidence"];

/** @param {import("./instrument.js").Instrument} desk */
export function dataTable(desk) {
  const body = element("tbody");
  const head = element("tr");
  const scroll = element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("desk.data") }, element("table", {}, element("thead", {}, head), body));
  const details = element("details", {}, element("summary", {}, say("desk.data")), element("p.soft", {}, say("desk.data.help")), scroll);
  const fill = () => {
    const columns = desk.columns.value;
    if (!details.open || !columns.n) return;
    const unit = unitOf(desk);
    head.replaceChildren(...NAMES.map((name) => element("th", { scope: "col" }, say(`desk.column.${name}`, { unit: speedUnit(unit) }))));
    const [from, to] = desk.span.value.map((time_s) => frameAt(columns, time_s));
    const step = Math.max(1, Math.ceil((to - from + 1) / ROWS));
    const rows = [];
    for (let k = from; k <= to; k += step) rows.push(rowOf(columns, k, unit.each));
    body.replaceChildren(...rows);
  };
  details.addEventListener("toggle", fill);
  desk.span.watch(fill, desk.life);
  desk.columns.watch(fill, desk.life);
  desk.scale.watch(fill, desk.life);
  return details;
}

/** @param {import("./columns.js").Columns} columns @param {number} k @param {number} each a pixel in the unit of lengths */
function rowOf({ time_s, heading_rad, speed_px_per_s, bend_rad, confidence }, k, each) {
  const cell = (/** @type {number} */ value, /** @type {(value: number) => string} */ words) => element("td", {}, Number.isNaN(value) ? "–" : words(value));
  return element("tr", {}, element("td", {}, time_s[k].toFixed(2)), element("td", {}, String(k)), cell(heading_rad[k], heading), cell(speed_px_per_s[k] * each, count), cell(bend_rad[k], (rad) => `${Math.round((rad * 180) / Math.PI)}°`), cell(confidence[k], percent));
}
