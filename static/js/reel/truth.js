// The ground truth over the film: boxes, shapes and ids of all individuals, on a canvas that is in step with
// the film, and the rows of the frame as a table.
// @ts-check
import { request } from "../app/api.js";
import { element } from "../app/element.js";
import { count, percent, say } from "../app/words.js";
import { loadAtlas } from "../flock/atlas.js";
import { strokeBoxes, WHOLE, writeId } from "./boxes.js";
import { shapesOf } from "./shapes.js";
import { createTracks, readTracks } from "./tracks.js";

/** Parts of the layer. */
export const PARTS = ["boxes", "shapes", "ids"];
/** Opacity of the shapes. */
const SHAPE_OPACITY = 0.6;
/** Time between two updates of the table, ms. */
const FILL_MS = 200;

/**
 * @param {{flock: Api.Flock, plan: () => Promise<import("../flock/plan.js").Plan>, on: string[], size: () => number[], life: AbortSignal, onChange: (on: string[]) => void, onProblem: (problem: unknown) => void}} options
 *   `on`: parts that are shown; `size`: width and height of the video, pixels
 */
export function truthLayer({ flock, plan, on, size, life, onChange, onProblem }) {
  const canvas = element("canvas.truth", { role: "img", hidden: true });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const layer = /** @type {HTMLCanvasElement} */ (document.createElement("canvas"));
  let tracks = createTracks();
  /** @type {Promise<void> | null} */
  let loading = null;
  /** @type {Promise<void> | null} */
  let shaping = null;
  /** @type {ReturnType<typeof shapesOf> | null} */
  let drawShapes = null;
  let [frame, isRead, filling] = [0, false, 0];

  const body = element("tbody");
  const heads = ["id", "x_px", "y_px", "visibility"].map((name) => element("th", { scope: "col" }, say(`reel.truth.${name}`)));
  const table = element("details.truth-table", { hidden: true, ontoggle: () => { if (table.open) load(); fill(); } }, element("summary", {}, say("reel.truth.table")),
    element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("reel.truth.table") }, element("table", {}, element("thead", {}, element("tr", {}, ...heads)), body)));
  const inputs = PARTS.map((name) => element("input", { type: "checkbox", value: name, checked: on.includes(name), onchange: change }));
  const choices = element("fieldset.choices", {}, element("legend.unseen", {}, say("reel.truth")), ...inputs.map((input) => element("label.choice", {}, input, element("span", {}, say(`reel.truth.${input.value}`)))));

  function load() {
    loading ??= read().catch((problem) => {
      loading = null;
      if (!life.aborted) onProblem(problem);
    });
  }
  async function read() {
    tracks = createTracks();
    await readTracks(await request("GET", `/v1/flocks/${flock.id}/tracks.csv`, { signal: life }), part, tracks);
    draw();
  }
  /** Draws when the frame that is shown has been read. */
  function part() {
    if (isRead || tracks.nFrames <= frame + 1) return;
    isRead = true;
    draw();
  }
  async function loadShapes() {
    const [planned, atlas] = await Promise.all([plan(), loadAtlas(`/v1/libraries/${flock.library_id}/`, { signal: life })]);
    life.addEventListener("abort", () => atlas.close());
    drawShapes = shapesOf(planned, atlas);
    draw();
  }
  function change() {
    on = inputs.filter((input) => input.checked).map((input) => input.value);
    begin();
    onChange(on);
  }
  function begin() {
    canvas.hidden = !on.length;
    table.hidden = !on.length;
    if (on.length) load();
    if (on.includes("shapes")) {
      shaping ??= loadShapes().catch((problem) => { shaping = null; if (!life.aborted) onProblem(problem); });
    }
    draw();
  }

  /** The place of the video in the canvas: it is centered and keeps its shape. */
  function fit() {
    const [width, height] = size();
    const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * devicePixelRatio));
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const zoom = Math.min(w / width, h / height);
    return { zoom, left: (w - width * zoom) / 2, top: (h - height * zoom) / 2 };
  }
  function draw() {
    if (canvas.hidden || life.aborted) return;
    const view = fit();
    context.resetTransform();
    context.clearRect(0, 0, canvas.width, canvas.height);
    const rows = tracks.at(frame);
    if (on.includes("shapes") && drawShapes) paintShapes(view, rows);
    context.setTransform(view.zoom, 0, 0, view.zoom, view.left, view.top);
    if (on.includes("boxes")) for (const track of rows) strokeBoxes(context, track, devicePixelRatio / view.zoom);
    if (on.includes("ids")) for (const track of rows) writeId(context, track, devicePixelRatio / view.zoom);
    canvas.setAttribute("aria-label", say("reel.truth.label", { n: rows.length, frame: String(frame), hidden: rows.filter(({ visibility }) => visibility < WHOLE).length }));
    // The table need not follow a playing film at every frame.
    if (table.open && !filling) filling = setTimeout(() => { filling = 0; fill(); }, FILL_MS);
  }
  /** @param {{zoom: number, left: number, top: number}} view @param {import("./tracks.js").Track[]} rows */
  function paintShapes({ zoom, left, top }, rows) {
    // Near animals hide far ones; only then does the film shine through.
    if (layer.width !== canvas.width || layer.height !== canvas.height) [layer.width, layer.height] = [canvas.width, canvas.height];
    const pen = /** @type {CanvasRenderingContext2D} */ (layer.getContext("2d"));
    pen.clearRect(0, 0, layer.width, layer.height);
    pen.save();
    pen.setTransform(zoom, 0, 0, zoom, left, top);
    pen.beginPath();
    pen.rect(0, 0, size()[0], size()[1]);
    pen.clip();
    drawShapes?.(pen, frame, rows);
    pen.restore();
    context.globalAlpha = SHAPE_OPACITY;
    context.drawImage(layer, 0, 0);
    context.globalAlpha = 1;
  }
  function fill() {
    if (!table.open) return;
    body.replaceChildren(...tracks.at(frame).map(({ id, x, y, visibility }) => element("tr", {}, ...[String(id), count(x), count(y), percent(visibility)].map((text) => element("td", {}, text)))));
  }

  const observer = new ResizeObserver(draw);
  observer.observe(canvas);
  life.addEventListener("abort", () => { observer.disconnect(); clearTimeout(filling); });
  begin();
  return { canvas, choices, table, draw, setFrame: (/** @type {number} */ next) => { [frame, isRead] = [next, tracks.nFrames > next + 1]; draw(); } };
}
