// The 3-D view of the virtual fish: near the fish, over its whole way, or as the film's camera sees it.
// @ts-check
import { element } from "../app/element.js";
import { heading, say } from "../app/words.js";
import { boxOf, glCanvas } from "./gl-canvas.js";
import { lengthOf } from "./glb.js";
import { depthFor, freeLens } from "./lens.js";
import { createOrbit, viewOf } from "./orbit.js";
import { directionOf, postureAt, boundsOf } from "./posture.js";
import { floorOf, plumbOf, wayOf } from "./scenery.js";
import { followPointers, turnButtons } from "./turning.js";

export const VIEWS = ["near", "whole", "filmed"];
/** How each view begins: a little from above, except as filmed. */
/** @type {Record<string, import("./orbit.js").Turned>} */
const STARTS = { near: { yaw: 0, pitch: 0.2, zoom: 1 }, whole: { yaw: 0.35, pitch: 0.35, zoom: 1 }, filmed: { yaw: 0, pitch: 0, zoom: 1 } };
const LINES = { floor: [0.45, 0.75, 0.82, 0.28], way: [1, 0.62, 0.4, 0.85], plumb: [0.75, 0.92, 0.95, 0.5] };

/**
 * @param {{fish: import("./glb.js").VirtualFish, lens: import("./lens.js").Lens | null, size: number[], fps: number, isFromAbove: boolean,
 *   life: AbortSignal}} options size of the film, pixels
 * @returns {{node: HTMLElement, canvas: HTMLCanvasElement, controls: HTMLElement, setFrame: (frame: number) => void, orbit: import("./orbit.js").Orbit} | null}
 */
export function createSpace({ fish, lens, size, fps, isFromAbove, life }) {
  const [length, bounds] = [lengthOf(fish), boundsOf(fish)];
  const middle = bounds.low.map((value, axis) => (value + bounds.high[axis]) / 2);
  const radius = Math.hypot(...bounds.high.map((value, axis) => value - bounds.low[axis])) / 2 + 0.8 * length;
  const floor = floorOf(bounds, length, isFromAbove);
  let [frame, view] = [0, "near"];
  const made = glCanvas({ fish, life, props: { className: "space", tabIndex: 0 }, sceneAt });
  if (!made) return null;
  const { canvas, ask } = made;
  const orbit = createOrbit(STARTS.near, ask);
  followPointers(canvas, orbit, life);

  /** @param {number} width @param {number} height @returns {import("./gl.js").Scene} */
  function sceneAt(width, height) {
    const posture = postureAt(fish, frame);
    const lines = [{ points: floor.lines, color: LINES.floor }, { points: wayOf(fish, frame, fps), color: LINES.way }];
    if (posture.isShown) lines.push({ points: plumbOf(posture.place, floor, length), color: LINES.plumb });
    if (view === "filmed" && lens) {
      const depth = -middle[2];
      return { posture, lines, lens, box: boxOf(size, width, height), ...viewOf(orbit.turned, [0, 0, -depth], depth) };
    }
    const isNear = view === "near";
    const depth = depthFor(isNear ? 0.62 * length : radius, width / height);
    return { posture, lines, lens: freeLens(width / height, depth), box: [0, 0, width, height], ...viewOf(orbit.turned, isNear ? posture.place : middle, depth) };
  }

  const radios = VIEWS.filter((one) => one !== "filmed" || lens).map((one) => element("label.choice", {}, element("input", { type: "radio", name: "fish-view", value: one, checked: one === view, onchange: () => { view = one; orbit.reset(STARTS[one]); } }), element("span", {}, say(`fish.view.${one}`))));
  const controls = element("div.stage-controls", {}, element("fieldset.choices", {}, element("legend.unseen", {}, say("fish.view")), ...radios), turnButtons(orbit));
  const node = element("div.stage.space-stage", {}, canvas);
  node.style.aspectRatio = size.join(" / ");
  return {
    node, canvas, controls, orbit,
    setFrame(next) {
      frame = next;
      canvas.setAttribute("aria-label", say("fish.space.label", { what: directionText(postureAt(fish, frame), isFromAbove) }));
      ask();
    },
  };
}

/** Returns where the fish points, as text. @param {import("./posture.js").Posture} posture @param {boolean} isFromAbove */
export function directionText(posture, isFromAbove) {
  if (!posture.isShown) return say("fish.hidden");
  const { heading_rad, away_rad } = directionOf(posture);
  // From above, every fish swims level.
  if (isFromAbove) return say("fish.heading", { heading: heading(heading_rad) });
  const degrees = Math.round((away_rad * 180) / Math.PI);
  const depth = Math.abs(degrees) < 5 ? say("fish.level") : say(degrees > 0 ? "fish.away" : "fish.toward", { n: Math.abs(degrees) });
  return `${say("fish.heading", { heading: heading(heading_rad) })} · ${depth}`;
}
