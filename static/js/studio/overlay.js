// The layer over the picture on which goals, obstacles and predators are drawn, moved and sized, by pointer and by keys.
// @ts-check
import { svg } from "../app/element.js";
import { say } from "../app/words.js";
import { shapeOf } from "./shapes.js";
import { drawn, moved, pathOf, sized, thingsOf, withThing } from "./things.js";

/** Pixels of the film that a predator's mark takes, and steps of the arrow keys. */
const [STEP, FAR] = [1, 10];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @typedef {import("./things.js").Slot} Slot
 * @typedef {{step: string, from: number[], line: number[][], draw?: Slot, thing?: import("./things.js").Thing, handle?: string | null}} Gesture line: way of the pointer
 * @param {{canvas: {focus: (options?: FocusOptions) => void}, size: number[], life: AbortSignal, tool: import("../app/store.js").Signal<string>,
 *   placed: () => import("./things.js").Placed, length_s: () => number, change: import("./settings.js").Change,
 *   onSelect: (key: string) => void}} options `size` of the film, pixels
 */
export function overlay({ canvas, size, life, tool, placed, length_s, change, onSelect }) {
  const hunter = svg("g", { class: "hunter", hidden: "" }, svg("circle", { class: "halo" }), svg("circle", { class: "line" }));
  const sketch = svg("polyline", { class: "sketch" });
  const layer = svg("svg", { class: "things", viewBox: `0 0 ${size.join(" ")}`, role: "group", "aria-label": say("thing.layer") }, sketch, hunter);
  /** @type {Map<string, ReturnType<typeof shapeOf>>} */
  const shapes = new Map();
  let [selected, n_gestures] = ["", 0];
  /** @type {Gesture | null} */
  let gesture = null;

  const unit = () => 1 / (layer.getScreenCTM()?.a || 1);
  const all = () => thingsOf(placed());
  const find = (/** @type {string} */ key) => all().find((one) => one.key === key);
  const pointOf = (/** @type {PointerEvent} */ event) => {
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(layer.getScreenCTM()?.inverse());
    return [x, y];
  };

  function draw() {
    const things = all();
    const keys = new Set(things.map(({ key }) => key));
    for (const [key, { group }] of shapes) if (!keys.has(key)) { group.remove(); shapes.delete(key); }
    for (const thing of things) {
      let shape = shapes.get(thing.key);
      if (!shape) { shapes.set(thing.key, shape = shapeOf(thing)); layer.append(shape.group); }
      shape.update(thing, unit());
      shape.group.classList.toggle("selected", thing.key === selected);
    }
    for (const circle of hunter.children) circle.setAttribute("r", String(11 * unit()));
  }

  /** @param {string} key @param {{focus?: boolean}} [options] */
  function select(key, { focus = false } = {}) {
    if (key !== selected) { selected = key; onSelect(key); draw(); }
    if (focus) shapes.get(key)?.group.focus({ preventScroll: true });
  }

  /** @param {Slot} thing @param {import("./things.js").Thing["value"] | undefined} value @param {string} [step] */
  const put = (thing, value, step) => change(withThing(placed(), thing, value), step ? { step, isGesture: true } : { step: `${thing.key}` });

  /** Adds a thing in the middle, for the keyboard. @param {import("./things.js").Kind} kind */
  function add(kind) {
    const middle = size.map((side) => Math.round(side / 2));
    const index = nextIndex(kind);
    const across = [[0, middle[1]], [size[0], middle[1]]];
    put({ kind, index, key: `${kind}-${index}` }, kind === "predator" ? { ...placed().predator, path: pathOf(across, length_s(), size) } : drawn(kind, middle, middle, size));
    select(`${kind}-${index}`, { focus: true });
  }

  /** @param {string} kind */
  const nextIndex = (kind) => (kind === "goal" ? placed().goals.length : kind === "predator" ? 0 : placed().obstacles.length);

  function remove(key = selected) {
    const thing = find(key);
    if (!thing) return;
    select("");
    put(thing, undefined);
    canvas.focus({ preventScroll: true });
  }

  layer.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0 || gesture) return;
    const target = /** @type {Element} */ (event.target);
    const key = target.closest(".thing")?.getAttribute("data-key");
    const at = pointOf(event);
    const step = `gesture-${n_gestures += 1}`;
    const drawing = /** @type {const} */ (["goal", "circle", "box", "predator"]).find((kind) => kind === tool.value);
    if (!drawing && !key) return select("");
    event.preventDefault();
    layer.setPointerCapture(event.pointerId);
    if (drawing) gesture = { step, from: at, line: [at], draw: { kind: drawing, index: nextIndex(drawing), key: `${drawing}-${nextIndex(drawing)}` } };
    else {
      gesture = { step, from: at, line: [], thing: find(key ?? ""), handle: target.closest(".handle")?.getAttribute("data-handle") };
      select(key ?? "", { focus: true });
    }
    return undefined;
  }, { signal: life });

  layer.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    if (!gesture) return;
    const at = pointOf(event);
    const { thing, handle, from, step, line } = gesture;
    if (gesture.draw?.kind === "predator") { line.push(at); sketch.setAttribute("points", line.map(String).join(" ")); }
    else if (gesture.draw) put(gesture.draw, drawn(gesture.draw.kind, from, at, size), step);
    else if (thing) put(thing, handle == null ? moved(thing, [at[0] - from[0], at[1] - from[1]], size) : sized(thing, Number(handle), at, size), step);
  }, { signal: life });

  const finish = (/** @type {PointerEvent} */ event) => {
    if (!gesture) return;
    const { draw: thing, from, line, step } = gesture;
    gesture = null;
    sketch.setAttribute("points", "");
    if (!thing) return;
    const path = thing.kind === "predator" ? pathOf(line, length_s(), size) : [];
    if (thing.kind !== "predator") put(thing, drawn(thing.kind, from, pointOf(event), size), step);
    else if (path.length > 1) put(thing, { ...placed().predator, path }, step);
    tool.set("");
    select(thing.key, { focus: true });
  };
  layer.addEventListener("pointerup", finish, { signal: life });
  layer.addEventListener("pointercancel", () => { gesture = null; sketch.setAttribute("points", ""); }, { signal: life });
  layer.addEventListener("focusin", (/** @type {FocusEvent} */ event) => { const key = /** @type {Element} */ (event.target).getAttribute("data-key"); if (key) select(key); }, { signal: life });

  layer.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const thing = find(selected);
    const arrow = /** @type {Record<string, number[]>} */ (ARROWS)[event.key];
    if (!thing || event.ctrlKey || event.metaKey || event.altKey) return;
    const far = event.shiftKey ? FAR : STEP;
    if (arrow) put(thing, moved(thing, arrow.map((way) => way * far), size));
    else if (event.key === "Delete" || event.key === "Backspace") remove();
    else if (event.key === "Enter" || event.key === "Escape") { select(""); canvas.focus({ preventScroll: true }); }
    else return;
    event.preventDefault();
    event.stopPropagation();
  }, { signal: life });

  tool.watch((name) => layer.setAttribute("data-tool", name), life);
  const observer = new ResizeObserver(draw);
  observer.observe(layer);
  life.addEventListener("abort", () => observer.disconnect());
  return {
    node: layer, draw, add, remove, select,
    /** Marks the predator of a plan. @param {import("../flock/plan.js").Plan | null} plan @param {number} frame */
    mark(plan, frame) {
      const at = plan?.head.predator?.[frame % plan.nFrames];
      hunter.toggleAttribute("hidden", !at);
      if (at) for (const circle of hunter.children) { circle.setAttribute("cx", String(at[0])); circle.setAttribute("cy", String(at[1])); }
    },
  };
}
