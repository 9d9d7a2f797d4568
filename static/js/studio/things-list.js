// What the animals flee from, and the list of what lies in the picture with the settings of the selected thing, for people
// who cannot or do not want to use the picture itself.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { radio } from "./own-controls.js";
import { at } from "./settings.js";
import { titleOf } from "./shapes.js";
import { thingsOf, withThing } from "./things.js";
import { toolButtons } from "./toolbar.js";

/** Settings of things: name, least, most, step. @type {Record<import("./things.js").Kind, [string, number, number, number][]>} */
const KNOBS = { goal: [["from_s", 0, 1e5, 0.1], ["until_s", 0, 1e5, 0.1], ["weight", 0, 20, 0.1]], predator: [["flee_bl", 0.1, 50, 0.1]], circle: [], box: [] };

/** What they may flee from, and the tools that make the path of a predator. */
const FLEE = ["nothing", "hunter", "path"];
const PATH_TOOLS = ["predator", "chase"];

/**
 * @param {{node: HTMLElement, life: AbortSignal, placed: () => import("./things.js").Placed, change: import("./settings.js").Change,
 *   layer: ReturnType<typeof import("./overlay.js").overlay>, tool: import("../app/store.js").Signal<string>}} options
 */
export function thingsList({ node, life, placed, change, layer, tool }) {
  const choices = FLEE.map((one) => radio("flee", one, say(`flee.${one}`), () => choose(one)));
  const tools = element("p.actions", { hidden: true }, ...toolButtons(PATH_TOOLS, { tool, life, add: layer.add }));
  const help = element("p.soft");
  const list = element("ul.thing-rows");
  const knobs = element("div.thing-knobs");
  node.append(element("fieldset.presets#flee", {}, element("legend", {}, say("flee.label")), element("div.chips", {}, ...choices.map((one) => one.node)), tools, help), list, knobs);
  let [drawn, selected, shown] = ["", "", ""];

  /** @param {string} what */
  function choose(what) {
    const { flee_bl } = placed().predator ?? {};
    const kept = flee_bl == null ? {} : { flee_bl };
    tool.set(what === "path" ? "predator" : "");
    if (what !== "path") change({ predator: what === "hunter" ? kept : undefined });
  }

  function draw() {
    const { predator } = placed();
    const isPath = PATH_TOOLS.includes(tool.value) || Boolean(predator?.path?.length);
    const value = isPath ? "path" : predator ? "hunter" : "nothing";
    for (const { input } of choices) input.checked = input.value === value;
    const hadFocus = !isPath && tools.contains(document.activeElement);
    tools.hidden = !isPath;
    if (hadFocus) choices.find(({ input }) => input.checked)?.input.focus();
    help.textContent = say(`flee.${value}.help`);
    const things = thingsOf(placed());
    const keys = things.map(titleOf).join();
    if (keys !== drawn) {
      drawn = keys;
      list.replaceChildren(...things.map((thing) => element("li", { "data-key": thing.key },
        element("button.quiet", { type: "button", onclick: () => layer.select(thing.key, { focus: true }) }, titleOf(thing)),
        element("button.small-button", { type: "button", "aria-label": say("thing.remove", { name: titleOf(thing) }), title: say("thing.remove", { name: titleOf(thing) }), onclick: () => layer.remove(thing.key) }, "✕"))));
    }
    for (const row of list.children) row.classList.toggle("selected", /** @type {HTMLElement} */ (row).dataset.key === selected);
    drawKnobs(things.find(({ key }) => key === selected) ?? (predator && value === "hunter" ? { key: "predator-0", kind: "predator", index: 0, value: predator } : undefined));
  }

  /** @param {import("./things.js").Thing | undefined} thing */
  function drawKnobs(thing) {
    const names = thing ? KNOBS[thing.kind] : [];
    if ((thing?.key ?? "") !== shown) {
      shown = thing?.key ?? "";
      knobs.replaceChildren(...names.map(([name, min, max, step]) => {
        const input = element("input.number", { type: "number", min, max, step: "any", placeholder: say(`thing.${name}.none`), oninput: () => {
          const now = thingsOf(placed()).find(({ key }) => key === shown)?.value ?? placed().predator;
          const next = { ...now, [name]: input.value === "" ? undefined : Number(input.value) };
          if (thing && input.validity.valid) change(withThing(placed(), thing, next), { step: `${shown} ${name}` });
        } });
        input.dataset.name = name;
        return element("label.control-line", {}, element("span", {}, say(`thing.${name}`)), input);
      }));
    }
    for (const input of knobs.querySelectorAll("input")) if (document.activeElement !== input) input.value = at(thing?.value, input.dataset.name ?? "") ?? "";
  }

  return { draw, select(/** @type {string} */ key) { selected = key; draw(); } };
}
