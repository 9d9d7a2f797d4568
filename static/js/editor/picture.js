// A picture of the film, on which the person points at the animal or its head, frames regions to ignore, or draws a ruler. With the keyboard, arrows move a cross, and Enter sets a point or the corners of a box.
// @ts-check
import { say } from "../app/words.js";
import { drawnCanvas, fitted, loadPicture } from "../desk/canvas.js";
import { drawSeen, nearest } from "./seen.js";

/** @typedef {"animal" | "head" | "ignore" | "ruler" | "zone"} Tool */
/** Shortest side of a box and length of a ruler, pixels of the film. */
const LEAST_PX = 4;

/** @typedef {{size: number[], moment: import("../app/store.js").Signal<number>, video: HTMLVideoElement, isBroken: import("../app/store.js").Signal<boolean>, picture: string}} Shown a film, and the address of a picture for where it cannot be played */

/**
 * @param {Shown} film
 * @param {{tool: import("../app/store.js").Signal<Tool>, draft?: import("./editor.js").Draft, seen?: import("./preview.js").Seen, proposed?: number[][], ruler?: import("../app/store.js").Signal<number[][] | null>,
 *   take?: (box_px: number[]) => void, paint?: (context: CanvasRenderingContext2D, zoom: number, colors: Record<string, string>) => void,
 *   changed?: import("../app/store.js").Signal<number>, life: AbortSignal}} parts
 *   draft: takes points and boxes; seen: what a measurement would find; proposed: boxes that the service proposes to ignore; ruler: takes the line;
 *   take: takes the box of a zone; paint: draws over the picture, again when `changed` does
 */
export function createPicture(film, { tool, draft, seen, proposed = [], ruler, take, paint, changed, life }) {
  const { size, video, isBroken } = film;
  /** @type {ImageBitmap | null} */
  let background = null;
  /** Start and end of what is being drawn, pixels of the film. @type {number[][] | null} */
  let drawing = null;
  /** Cross of the keyboard. */
  let cross = size.map((side) => side / 2);
  let isKeyboard = false;
  const { canvas, ask } = drawnCanvas(life, draw, { tabIndex: 0, className: "editor-picture", role: "application", "aria-label": say("editor.picture") });
  canvas.style.aspectRatio = size.join(" / ");

  /** @param {import("../desk/canvas.js").Paper} paper */
  function draw({ context, width, height, colors }) {
    const { zoom, left, top } = fitted(size, width, height);
    context.translate(left, top);
    context.scale(zoom, zoom);
    const source = !isBroken.value && video.readyState >= 2 ? video : background;
    if (source) context.drawImage(source, 0, 0, size[0], size[1]);
    paint?.(context, zoom, colors);
    const found = nearest(seen?.value ?? null, film.moment.value);
    if (found?.frame === film.moment.value) drawSeen(context, found, zoom, colors.water);
    context.lineWidth = 2 / zoom;
    for (const [x, y, w, h] of proposed) {
      context.strokeStyle = "#e8641b";
      context.strokeRect(x, y, w, h);
    }
    const ignored = /** @type {{box_px: number[]}[]} */ (draft?.value.ignore ?? []);
    const frames = [...ignored.map(({ box_px }) => box_px), ...(drawing && (tool.value === "ignore" || tool.value === "zone") ? [boxOf(drawing)] : [])];
    for (const [x, y, w, h] of frames) {
      context.fillStyle = "rgb(163 22 31 / 0.45)";
      context.fillRect(x, y, w, h);
      context.strokeStyle = "#fff";
      context.strokeRect(x, y, w, h);
    }
    const line = drawing && tool.value === "ruler" ? drawing : ruler?.value;
    if (line) drawRuler(context, line, zoom, colors);
    for (const { point, color } of [{ point: draft?.value.animal_at?.at_px, color: colors.accent }, { point: draft?.value.head?.point, color: colors.water }]) if (point) drawTarget(context, point, color, zoom);
    if (isKeyboard) drawTarget(context, cross, "#fff", zoom);
  }

  /** @param {MouseEvent} event @returns {number[]} */
  const pointOf = (event) => {
    const box = canvas.getBoundingClientRect();
    const { zoom, left, top } = fitted(size, box.width, box.height);
    return [(event.clientX - box.left - left) / zoom, (event.clientY - box.top - top) / zoom].map((value, k) => Math.min(size[k], Math.max(0, Math.round(value * 10) / 10)));
  };
  const begin = (/** @type {number[]} */ point) => { drawing = [point, point]; ask(); };
  const end = () => {
    if (!drawing) return;
    const [from, to] = drawing;
    const frame = film.moment.value;
    if (draft && tool.value === "animal") draft.set({ ...draft.value, animal_at: { frame, at_px: to } });
    if (draft && tool.value === "head") draft.set({ ...draft.value, head: { frame, point: to } });
    const box_px = boxOf(drawing);
    const isBox = box_px[2] >= LEAST_PX && box_px[3] >= LEAST_PX;
    if (isBox && tool.value === "zone") take?.(box_px);
    if (draft && isBox && tool.value === "ignore") draft.set({ ...draft.value, ignore: [...draft.value.ignore ?? [], { box_px, from_s: null, to_s: null }] });
    if (tool.value === "ruler" && Math.hypot(to[0] - from[0], to[1] - from[1]) >= LEAST_PX) ruler?.set(drawing);
    drawing = null;
    ask();
  };
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); isKeyboard = false; begin(pointOf(event)); });
  canvas.addEventListener("pointermove", (event) => { if (drawing && !isKeyboard) { drawing = [drawing[0], pointOf(event)]; ask(); } });
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", () => { drawing = null; ask(); });
  canvas.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 1 : 10;
    const by = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] })[event.key];
    if (!by && event.key !== "Enter") return;
    event.preventDefault();
    isKeyboard = true;
    if (by) cross = cross.map((value, k) => Math.min(size[k], Math.max(0, value + by[k])));
    else if (!drawing) { begin([...cross]); if (tool.value === "animal" || tool.value === "head") end(); } else end();
    if (drawing) drawing = [drawing[0], [...cross]];
    ask();
  });
  canvas.addEventListener("blur", () => { isKeyboard = false; ask(); });
  for (const shown of [draft, ruler, tool, seen, changed, film.moment]) shown?.watch(ask, life);
  isBroken.watch((now) => { if (now) void loadPicture(film.picture, life).then((found) => { background = found; ask(); }); }, life);
  for (const event of ["seeked", "loadeddata"]) video.addEventListener(event, ask, { signal: life });
  return canvas;
}

/** Returns the box between two corners. @param {number[][]} corners */
export function boxOf([a, b]) {
  const [x, y] = [0, 1].map((k) => Math.floor(Math.min(a[k], b[k])));
  return [x, y, Math.ceil(Math.max(a[0], b[0])) - x, Math.ceil(Math.max(a[1], b[1])) - y];
}

/** Draws a cross in a ring. @param {CanvasRenderingContext2D} context @param {number[]} point @param {string} color @param {number} zoom */
function drawTarget(context, [x, y], color, zoom) {
  const unit = 1 / zoom;
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(10 17 20 / 0.7)", 5], [color, 2.5]])) {
    context.strokeStyle = style;
    context.lineWidth = wide * unit;
    context.beginPath();
    context.arc(x, y, 10 * unit, 0, 7);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + 4 * dx * unit, y + 4 * dy * unit);
      context.lineTo(x + 16 * dx * unit, y + 16 * dy * unit);
    }
    context.stroke();
  }
}

/** Draws a line with ends. @param {CanvasRenderingContext2D} context @param {number[][]} line @param {number} zoom @param {Record<string, string>} colors */
function drawRuler(context, [[ax, ay], [bx, by]], zoom, colors) {
  const far = Math.hypot(bx - ax, by - ay) || 1;
  const [nx, ny] = [(-(by - ay) / far) * (9 / zoom), ((bx - ax) / far) * (9 / zoom)];
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(10 17 20 / 0.7)", 6], [colors.water, 3]])) {
    context.strokeStyle = style;
    context.lineWidth = wide / zoom;
    context.beginPath();
    context.moveTo(ax, ay);
    context.lineTo(bx, by);
    for (const [x, y] of [[ax, ay], [bx, by]]) {
      context.moveTo(x - nx, y - ny);
      context.lineTo(x + nx, y + ny);
    }
    context.stroke();
  }
}
