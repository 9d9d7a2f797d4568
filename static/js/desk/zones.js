// Zones: parts of the picture that a person draws, and how long the animal was in each. They are kept in the browser for
// all films of the same size, because a camera that stands still sees the same arena.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { signal } from "../app/store.js";
import { count, percent, say, seconds } from "../app/words.js";
import { createPicture } from "../editor/picture.js";
import { showProblem } from "../parts/problem.js";
import { drawHeat, heatOf } from "./heat.js";

/** @typedef {{name: string, shape: "rect" | "ellipse", box_px: number[]}} Zone */

/** Most zones of a request, as in the service. */
const MOST = 32;

/** Returns zones as a query. @param {Zone[]} zones */
const queryOf = (zones) => zones.map(({ name, shape, box_px }) => `${name}:${shape}:${box_px.join(",")}`).join(";");

/** @param {import("./instrument.js").Instrument} desk */
export function zonesPanel(desk) {
  const { library, life, columns } = desk;
  const size = library.image_size_px;
  const key = `flockreel-zones-${size.join("x")}`;
  const zones = signal(/** @type {Zone[]} */ (JSON.parse(localStorage.getItem(key) ?? "[]")));
  zones.watch((now) => localStorage.setItem(key, JSON.stringify(now)), life);
  /** @type {ReturnType<typeof heatOf> | null} */
  let heat = null;
  const shape = element("select", { name: "zone-shape" }, ...["rect", "ellipse"].map((name) => element("option", { value: name }, say(`desk.zone.${name}`))));
  const take = (/** @type {number[]} */ box_px) => {
    const taken = new Set(zones.value.map(({ name }) => name));
    const name = Array.from({ length: MOST }, (_, k) => `zone${k + 1}`).find((one) => !taken.has(one));
    if (name) zones.set([...zones.value, { name, shape: /** @type {Zone["shape"]} */ (shape.value), box_px }]);
  };
  const paint = (/** @type {CanvasRenderingContext2D} */ context, /** @type {number} */ zoom, /** @type {Record<string, string>} */ colors) => {
    if (heat) drawHeat(context, heat, colors);
    for (const zone of zones.value) drawZone(context, zone, zoom);
  };
  const shown = { size, moment: desk.moment, video: element("video"), isBroken: signal(true), picture: `/v1/libraries/${library.id}/background.png` };
  const changed = signal(0);
  const picture = createPicture(shown, { tool: signal(/** @type {import("../editor/picture.js").Tool} */ ("zone")), take, paint, changed, life });
  picture.setAttribute("aria-label", say("desk.zone.picture"));
  const update = () => { heat = heatOf(columns.value, size); changed.set(changed.value + 1); };
  columns.watch(update, life);

  const table = element("div");
  const file = element("a.button.quiet", { download: "" }, say("desk.zone.file"));
  const fill = async () => {
    changed.set(changed.value + 1);
    const asked = zones.value;
    const query = `?zones=${encodeURIComponent(queryOf(asked))}`;
    file.href = `/v1/libraries/${library.id}/summary.csv${query}`;
    try {
      const summary = asked.length ? await get(`/v1/libraries/${library.id}/summary.json${query}`, life) : {};
      // More was drawn in the meantime.
      if (asked === zones.value) table.replaceChildren(...(asked.length ? [tableOf(zones, /** @type {any} */ (summary))] : [element("p.soft", {}, say("desk.zone.none"))]));
    } catch (problem) {
      if (!life.aborted) showProblem(table, problem);
    }
  };
  zones.watch(fill, life);
  desk.scale.watch(fill, life);
  return element("div.panel-zones", {}, element("p.soft", {}, say("desk.zone.help")), element("div.editor-box", {}, picture), element("label.field", {}, say("desk.zone.shape"), shape), table, element("p.actions", {}, file));
}

/** @param {import("../app/store.js").Signal<Zone[]>} zones @param {Record<string, number | null>} summary */
function tableOf(zones, summary) {
  const unit = summary.px_per_cm ? "cm" : "bl";
  const known = (/** @type {number | null} */ value, /** @type {(n: number) => string} */ words) => (value === null || value === undefined ? "–" : words(value));
  const row = (/** @type {Zone} */ zone) => {
    const of = (/** @type {string} */ what) => summary[`${zone.name}_${what}`];
    const name = element("input", { name: "zone-name", value: zone.name, required: true, maxLength: 32, pattern: "[A-Za-z0-9_]+", "aria-label": say("desk.zone.name"), onchange: () => {
      const isFree = zones.value.every((one) => one === zone || one.name !== name.value);
      name.setCustomValidity(isFree ? "" : say("desk.zone.twice"));
      if (name.reportValidity()) zones.set(zones.value.map((one) => (one === zone ? { ...zone, name: name.value } : one)));
    } });
    const remove = element("button.quiet.small-button", { type: "button", "aria-label": say("editor.remove_one", { what: zone.name }), onclick: () => zones.set(zones.value.filter((one) => one !== zone)) }, "×");
    const cells = [known(of("s"), seconds), known(of("share"), percent), known(of("visits"), count), known(of("first_s"), seconds), known(of(`distance_${unit}`), (n) => say(`unit.${unit}`, { n }))];
    return element("tr", {}, element("th", { scope: "row" }, name), ...cells.map((text) => element("td", {}, text)), element("td", {}, remove));
  };
  const heads = ["name", "time", "share", "visits", "first", "distance"].map((name) => element("th", { scope: "col" }, say(`desk.zone.${name}`)));
  return element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("desk.zone.table") }, element("table", {}, element("thead", {}, element("tr", {}, ...heads, element("td"))), element("tbody", {}, ...zones.value.map(row))));
}

/** @param {CanvasRenderingContext2D} context @param {Zone} zone @param {number} zoom */
function drawZone(context, { name, shape, box_px: [x, y, w, h] }, zoom) {
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(10 17 20 / 0.7)", 4], ["#fff", 2]])) {
    [context.strokeStyle, context.lineWidth] = [style, wide / zoom];
    context.beginPath();
    if (shape === "ellipse") context.ellipse(x + w / 2, y + h / 2, w / 2, h / 2, 0, 0, 7);
    else context.rect(x, y, w, h);
    context.stroke();
  }
  context.font = `600 ${13 / zoom}px system-ui, sans-serif`;
  [context.strokeStyle, context.lineWidth, context.fillStyle] = ["rgb(10 17 20 / 0.7)", 3 / zoom, "#fff"];
  const at = /** @type {const} */ ([x + 6 / zoom, y + (shape === "ellipse" ? h / 2 : 16 / zoom)]);
  context.strokeText(name, ...at);
  context.fillText(name, ...at);
}
