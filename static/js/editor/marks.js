// The list of what was drawn, each with a button that removes it, and a region to ignore with its time.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { isSame } from "./settings.js";

/** @typedef {Api.Schemas["IgnoreParam"]} Ignored */

/** @param {{draft: import("./editor.js").Draft, proposed: number[][], life: AbortSignal}} options */
export function marksList({ draft, proposed, life }) {
  const list = element("ul.editor-marks");
  let drawn = "";
  const draw = (/** @type {import("./settings.js").Settings} */ { animal_at, head, ignore = [] }) => {
    // A time that is being typed is not drawn again, so that it keeps the focus.
    const key = JSON.stringify([animal_at, head, ignore.map((/** @type {Ignored} */ { box_px }) => box_px)]);
    if (key === drawn) return;
    drawn = key;
    const at = (/** @type {number[]} */ point) => point.map(Math.round).join(", ");
    const taken = (/** @type {number[]} */ box_px) => ignore.some((/** @type {Ignored} */ one) => isSame(one.box_px, box_px));
    list.replaceChildren(
      ...(animal_at ? [row(say("editor.mark.animal", { at: at(animal_at.at_px), frame: String(animal_at.frame) }), () => change({ animal_at: null }))] : []),
      ...(head ? [row(say("editor.mark.head", { at: at(head.point), frame: String(head.frame) }), () => change({ head: null }))] : []),
      ...ignore.map((/** @type {Ignored} */ { box_px }, /** @type {number} */ k) => row(say("editor.mark.ignore", { size: `${box_px[2]} × ${box_px[3]}` }), () => change({ ignore: ignored().filter((_, idx) => idx !== k) }), times(k))),
      ...proposed.filter((box_px) => !taken(box_px)).map((box_px) => element("li", {}, element("button.quiet", { type: "button", onclick: () => change({ ignore: [...ignored(), { box_px, from_s: null, to_s: null }] }) }, say("editor.take", { size: `${box_px[2]} × ${box_px[3]}` })))));
  };
  const ignored = () => /** @type {Ignored[]} */ (draft.value.ignore ?? []);
  const change = (/** @type {import("./settings.js").Settings} */ patch) => draft.set({ ...draft.value, ...patch });
  /** Fields for the time in which a region is ignored. @param {number} k */
  const times = (k) => element("span.editor-times", {}, .../** @type {const} */ (["from_s", "to_s"]).map((name) => {
    const input = element("input.number", { type: "number", min: 0, step: 0.1, inputMode: "decimal", value: ignored()[k][name] ?? "", placeholder: say(`editor.time.${name}`), "aria-label": say(`editor.ignore.${name}`), oninput: () => {
      if (input.validity.valid) change({ ignore: ignored().map((one, idx) => (idx === k ? { ...one, [name]: input.value === "" ? null : input.valueAsNumber } : one)) });
    } });
    return input;
  }));
  draft.watch(draw, life);
  return list;
}

/** @param {string} text @param {() => void} remove @param {...Node} more */
const row = (text, remove, ...more) => element("li", {}, element("span", {}, text), ...more, element("button.quiet", { type: "button", "aria-label": say("editor.remove_one", { what: text }), onclick: remove }, say("editor.remove")));
