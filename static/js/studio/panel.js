// The panel: presets, the few settings that matter most, among them flight and background, and groups with all the others.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { control } from "./control.js";
import { grouped, isIdle } from "./groups.js";
import { isImplied } from "./implied.js";
import { frameLimits, mostCount } from "./limits.js";
import { background, files, presets, seed, size } from "./own-controls.js";

/**
 * @param {import("./control.js").Studio & {valueOf: (name: string) => any, film: {fps: number, size: number[]}, formats: string[]}} studio
 *   `valueOf` returns the value in force
 */
export function panel(studio) {
  const { fields, valueOf, film } = studio;
  const names = grouped(fields);
  /** @type {import("./control.js").Control[]} */
  const controls = [];
  const put = (/** @type {import("./control.js").Control} */ one) => { controls.push(one); return one.node; };
  const field = (/** @type {string} */ name) => /** @type {import("./schema.js").Field} */ (fields.get(name));
  const plain = (/** @type {string[]} */ list) => list.map((name) => put(name === "seed" ? seed(field(name), studio) : control(field(name), studio)));
  /** @template T @param {string} name @param {(field: import("./schema.js").Field, studio: import("./control.js").Studio, more: T) => import("./control.js").Control} make @param {T} more */
  const own = (name, make, more) => (fields.has(name) ? [put(make(field(name), studio, more))] : []);
  /** @type {{node: HTMLElement, mark: HTMLElement}[]} */
  const groups = [];
  const group = (/** @type {string} */ name, /** @type {Page.Child[]} */ ...children) => {
    const mark = element("span.mark");
    const node = element(`details.group#group-${name}`, {}, element("summary", {}, say(`group.${name}`), " ", mark), ...children);
    groups.push({ node, mark });
    return node;
  };

  const behaviors = presets(studio);
  const useZones = element("input", { type: "checkbox", onchange: () => studio.change({ "rules.zones": useZones.checked ? {} : null, ...Object.fromEntries(names.zones.map((name) => [name, undefined])) }, { step: "rules.zones" }) });
  const zones = element("div", {}, ...plain(names.zones));
  const things = element("div.things-list");
  const node = element("div.settings", {}, behaviors.node, ...plain(names.main), things, ...own("render.background", background, studio), ...plain(names.more),
    group("move", ...plain(names.move), group("fine", ...plain(names.fine)), group("zones", element("label.check", {}, useZones, element("span", {}, say("zones.use"))), zones), group("matching", ...plain(names.matching))),
    group("look", ...own("render.size_px", size, film.size), ...plain(names.look), element("p.soft", {}, say("set.look.note"))),
    group("files", ...own("render.formats", files, studio.formats), ...plain(names.files)));

  return {
    node, things,
    /** @param {import("./settings.js").Settings} settings @param {number} n individuals */
    update(settings, n) {
      behaviors.update(settings.preset);
      const params = { loop: valueOf("loop"), position: valueOf("position") };
      for (const { name, update } of controls) {
        const limits = name === "frames" ? frameLimits(params, n) : name === "count" ? [1, mostCount(valueOf("frames") ?? 1)] : undefined;
        update(valueOf(name), { isSet: name in settings && !isImplied(name, fields, valueOf), limits, perUnit: name === "frames" ? film.fps : 1, isIdle: isIdle(name, valueOf) });
      }
      useZones.checked = valueOf("rules.zones") != null;
      zones.hidden = !useZones.checked;
      for (const { node: one, mark } of groups) {
        const n_set = one.querySelectorAll(".is-set").length;
        mark.textContent = n_set ? say("group.changed", { n: n_set }) : "";
      }
    },
  };
}
