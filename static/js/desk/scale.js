// The scale of a film: pixels per centimetre, from a ruler or from the length of the animal. It changes the unit of
// every number on the desk. Nothing is measured again.
// @ts-check
import { patch } from "../app/api.js";
import { element } from "../app/element.js";
import { signal } from "../app/store.js";
import { say } from "../app/words.js";
import { showProblem } from "../parts/problem.js";
import { createPicture } from "../editor/picture.js";

/** @typedef {{name: "cm" | "bl" | "px", each: number}} Unit name, and how many of it a pixel is */

/** Returns the unit of lengths and speeds. @param {import("./instrument.js").Instrument} desk @returns {Unit} */
export function unitOf({ library: { length_px }, scale: { value: px_per_cm } }) {
  if (px_per_cm) return { name: "cm", each: 1 / px_per_cm };
  return length_px ? { name: "bl", each: 1 / length_px } : { name: "px", each: 1 };
}

/** Returns the name of the unit of speeds. @param {Unit} unit */
export const speedUnit = ({ name }) => say(`unit.speed.${name}`);

/**
 * Returns the panel that sets the scale.
 * @param {import("./instrument.js").Instrument} desk @param {import("./player.js").Player} player
 */
export function scalePanel(desk, player) {
  const { library, life, scale } = desk;
  const length_px = library.length_px;
  const ruler = signal(/** @type {number[][] | null} */ (null));
  const picture = createPicture({ size: library.image_size_px, moment: desk.moment, video: player.video, isBroken: player.isBroken, picture: `/v1/libraries/${library.id}/background.png` }, { tool: signal(/** @type {import("../editor/picture.js").Tool} */ ("ruler")), ruler, life });
  const problem = element("div");
  const set = async (/** @type {Api.Body<"patch", "/v1/libraries/{id}">} */ change) => {
    try {
      scale.set((await patch(`/v1/libraries/${library.id}`, change)).px_per_cm ?? null);
      problem.replaceChildren();
    } catch (reason) {
      showProblem(problem, reason);
    }
  };
  const field = (/** @type {"line_cm" | "length_cm"} */ name, /** @type {(cm: number) => void} */ change) => {
    const input = element("input", { type: "number", name, min: 0, step: "any", inputMode: "decimal", onchange: () => { if (input.valueAsNumber > 0) change(input.valueAsNumber); } });
    return { input, label: element("label.field", {}, say(`desk.scale.${name}`), input, element("small", {}, say(`desk.scale.${name}.help`))) };
  };
  const measure = () => {
    if (!ruler.value || !(line.input.valueAsNumber > 0)) return;
    const [[ax, ay], [bx, by]] = ruler.value;
    void set({ px_per_cm: Math.hypot(bx - ax, by - ay) / line.input.valueAsNumber });
  };
  const line = field("line_cm", measure);
  const animal = field("length_cm", (length_cm) => void set({ length_cm }));
  ruler.watch(measure, life);
  const told = element("p", { role: "status" });
  const none = element("button.quiet", { type: "button", onclick: () => void set({ px_per_cm: null }) }, say("desk.scale.none"));
  scale.watch((px_per_cm) => {
    none.hidden = !px_per_cm;
    const size = length_px ? say(px_per_cm ? "desk.size.known" : "desk.size.px", { cm: length_px / (px_per_cm ?? 1), px: length_px }) : say("desk.size.none");
    told.textContent = [...(px_per_cm ? [say("desk.scale.is", { px: px_per_cm })] : []), size].join(" ");
  }, life);
  return element("div.panel-size", {}, told, element("p.soft", {}, say(`desk.scale.help.${library.view === "top" ? "top" : "side"}`)), element("div.editor-box", {}, picture),
    element("div.fields", {}, line.label, length_px ? animal.label : false), problem, element("p.actions", {}, none));
}
