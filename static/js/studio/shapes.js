// The drawings of goals, obstacles and predators over the picture: SVG groups that follow their things.
// @ts-check
import { svg } from "../app/element.js";
import { say } from "../app/words.js";
import { handlesOf } from "./things.js";

/** @typedef {import("./things.js").Thing} Thing */

/** Radius of what can be grasped, of a handle and of a goal, pixels of the screen. */
const [GRASP, HANDLE, GOAL] = [22, 6, 13];

/** Returns what a thing is called. @param {Thing} thing */
export function titleOf({ kind, index, value }) {
  const at = "at_px" in value ? value.at_px : "circle" in value ? value.circle.center_px : "box" in value ? value.box.box_px : [];
  return say(`thing.${kind}.name`, { n: index + 1, x: String(Math.round(at[0])), y: String(Math.round(at[1])) });
}

/**
 * Returns the drawing of a thing. Its `update` follows a newer state.
 * @param {Thing} thing
 */
export function shapeOf(thing) {
  const group = svg("g", { class: `thing thing-${thing.kind}`, tabindex: 0, role: "button", "data-key": thing.key });
  const [grasp, halo, line] = ["grasp", "halo", "line"].map((name) => svg(tagOf(thing.kind), { class: name }));
  const handles = svg("g", { class: "handles" });
  group.append(grasp, halo, line, handles);
  return {
    group,
    /** @param {Thing} one @param {number} unit pixels of the film per pixel of the screen */
    update(one, unit) {
      group.setAttribute("aria-label", titleOf(one));
      const attributes = attributesOf(one, unit);
      for (const node of [grasp, halo, line]) for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, String(value));
      if (one.kind === "goal") grasp.setAttribute("r", String(GRASP * unit));
      const points = handlesOf(one);
      while (handles.childElementCount > points.length) handles.lastElementChild?.remove();
      for (const [k, [x, y]] of points.entries()) {
        const handle = handles.children[k] ?? handles.appendChild(svg("g", { class: "handle", "data-handle": k }, svg("circle", { class: "grasp" }), svg("circle", { class: "dot" })));
        for (const circle of handle.children) Object.entries({ cx: x, cy: y, r: unit * (circle.classList.contains("dot") ? HANDLE : GRASP * (one.kind === "predator" ? 0.6 : 1)) }).forEach(([name, value]) => circle.setAttribute(name, String(value)));
      }
    },
  };
}

/** @param {string} kind */
const tagOf = (kind) => ({ goal: "circle", circle: "circle", box: "rect", predator: "polyline" })[kind] ?? "g";

/** @param {Thing} thing @param {number} unit @returns {Record<string, string | number>} */
function attributesOf({ kind, value }, unit) {
  if (kind === "goal") return { cx: value.at_px[0], cy: value.at_px[1], r: GOAL * unit };
  if (kind === "circle") return { cx: value.circle.center_px[0], cy: value.circle.center_px[1], r: value.circle.radius_px };
  if (kind === "predator") return { points: (value.path ?? []).map((one) => one.at_px.join()).join(" ") };
  const [x, y, width, height] = value.box.box_px;
  return { x, y, width, height };
}
