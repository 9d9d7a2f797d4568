// Turning and zooming the 3-D view: drag, wheel, two fingers, buttons.
// @ts-check
import { element, svg } from "../app/element.js";
import { say } from "../app/words.js";

/** Turn of a drag, radians a CSS pixel; of a button, radians; zoom of a button. */
const DRAG = 0.009;
const STEP = Math.PI / 12;
const ZOOM = 1.25;

/** @param {HTMLElement} node @param {import("./orbit.js").Orbit} orbit @param {AbortSignal} life */
export function followPointers(node, orbit, life) {
  /** Fingers and pointers that are down: where they were. @type {Map<number, number[]>} */
  const down = new Map();
  const apart = () => {
    const [a, b] = [...down.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  /** @template {keyof HTMLElementEventMap} K @param {K} name @param {(event: HTMLElementEventMap[K]) => void} act @param {AddEventListenerOptions} [options] */
  const on = (name, act, options) => node.addEventListener(name, act, { signal: life, ...options });
  on("pointerdown", (event) => {
    if (event.button !== 0) return;
    node.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });
  on("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const wasApart = down.size === 2 ? apart() : 0;
    down.set(event.pointerId, [event.clientX, event.clientY]);
    if (wasApart) return orbit.zoom(apart() / wasApart);
    if (down.size === 1) orbit.turn(-DRAG * (event.clientX - before[0]), DRAG * (event.clientY - before[1]));
    return undefined;
  });
  for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) on(name, (event) => down.delete(event.pointerId));
  on("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 33 : 1;
    orbit.zoom(Math.exp(-0.0015 * lines * event.deltaY));
  }, { passive: false });
  on("dblclick", () => orbit.reset());
}

/** Shapes of the buttons, in a square of 24. @type {Record<string, string>} */
const SHAPES = {
  left: "M14 5l-7 7 7 7", right: "M10 5l7 7-7 7", up: "M5 14l7-7 7 7", down: "M5 10l7 7 7-7",
  nearer: "M12 5v14M5 12h14", farther: "M5 12h14", reset: "M18 8a7 7 0 1 0 1 5M18 4v4h-4",
};

/** Returns the buttons for a person without a pointer that drags. @param {import("./orbit.js").Orbit} orbit */
export function turnButtons(orbit) {
  const acts = {
    left: () => orbit.turn(-STEP, 0), right: () => orbit.turn(STEP, 0), up: () => orbit.turn(0, STEP), down: () => orbit.turn(0, -STEP),
    nearer: () => orbit.zoom(ZOOM), farther: () => orbit.zoom(1 / ZOOM), reset: () => orbit.reset(),
  };
  const buttons = Object.entries(acts).map(([name, act]) => element("button.quiet.icon", { type: "button", title: say(`fish.turn.${name}`), "aria-label": say(`fish.turn.${name}`), onclick: act },
    svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: SHAPES[name] }))));
  return element("div.buttons.turn-buttons", { role: "group", "aria-label": say("fish.turn") }, ...buttons);
}
