// The list of what lies in the picture, with the settings of the selected thing, for people who cannot or do not
// want to use the picture itself.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { titleOf } from "./shapes.js";
import { thingsOf, withThing } from "./things.js";

/** Settings of things: name, least, most, step. */
const KNOBS = { goal: [["from_s", 0, 1e5, 0.1], ["until_s", 0, 1e5, 0.1], ["weight", 0, 20, 0.1]], predator: [["flee_bl", 0.1, 50, 0.1]], circle: [], box: [] };

/**
 * @param {{node: HTMLElement, placed: () => import("./things.js").Placed, change: (patch: any, options?: any) => void,
 *   layer: any, tool: import("../app/store.js").Signal<string>}} options
 */
export function thingsList({ node, placed, change, layer, tool }) {
  const flee = element("select#flee", { onchange: () => choose(flee.value) }, ...["nothing", "hunter", "path"].map((one) => element("option", { value: one }, say(`flee.${one}`))));
  const list = element("ul.thing-rows");
  const knobs = element("div.thing-knobs");
  node.append(element("div.control", {}, element("div.control-line", {}, element("label", { htmlFor: "flee" }, say("flee.label")), flee)), list, knobs);
  let [drawn, selected, shown] = ["", "", ""];

  /** @param {string} what */
  function choose(what) {
    const { flee_bl } = placed().predator ?? {};
    const kept = flee_bl == null ? {} : { flee_bl };
    if (what === "path") layer.add("predator");
    else change({ predator: what === "hunter" ? kept : undefined });
  }

  function draw() {
    const { predator } = placed();
    const value = predator ? (predator.path?.length ? "path" : "hunter") : "nothing";
    flee.value = tool.value === "predator" && !predator ? "nothing" : value;
    const things = thingsOf(placed());
    const keys = things.map(titleOf).join();
    if (keys !== drawn) {
      drawn = keys;
      list.replaceChildren(...things.map((thing) => element("li", { "data-key": thing.key },
        element("button.quiet", { type: "button", onclick: () => layer.select(thing.key, { focus: true }) }, titleOf(thing)),
        element("button.small-button", { type: "button", "aria-label": say("thing.remove", { name: titleOf(thing) }), title: say("thing.remove", { name: titleOf(thing) }), onclick: () => layer.remove(thing.key) }, "✕"))));
    }
    for (const row of list.children) row.classList.toggle("selected", /** @type {HTMLElement} */ (row).dataset.key === selected);
    drawKnobs(things.find(({ key }) => key === selected) ?? (value === "hunter" ? { key: "predator-0", kind: "predator", index: 0, value: predator } : undefined));
  }

  /** @param {any} thing */
  function drawKnobs(thing) {
    const names = thing ? /** @type {any} */ (KNOBS)[thing.kind] : [];
    if ((thing?.key ?? "") !== shown) {
      shown = thing?.key ?? "";
      knobs.replaceChildren(...names.map((/** @type {any[]} */ [name, min, max, step]) => {
        const input = element("input.number", { type: "number", min, max, step: "any", placeholder: say(`thing.${name}.none`), oninput: () => {
          const now = thingsOf(placed()).find(({ key }) => key === shown) ?? { ...thing, value: placed().predator };
          const { [name]: _, ...rest } = now.value;
          if (input.validity.valid) change(withThing(placed(), now, input.value === "" ? rest : { ...rest, [name]: Number(input.value) }), { step: `${shown} ${name}` });
        } });
        input.dataset.name = name;
        return element("label.control-line", {}, element("span", {}, say(`thing.${name}`)), input);
      }));
    }
    for (const input of knobs.querySelectorAll("input")) if (document.activeElement !== input) input.value = thing.value[/** @type {string} */ (input.dataset.name)] ?? "";
  }

  return { draw, select(/** @type {string} */ key) { selected = key; draw(); } };
}
