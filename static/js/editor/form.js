// The settings of the editor that are not drawn: a few in sight, all others of the schema below "More".
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { control } from "../studio/control.js";
import { DRAWN, isSame } from "./settings.js";

/** Settings that are in sight. */
const MAIN = ["view", "follow", "threshold"];

/** @param {{fields: import("./settings.js").Fields, draft: import("./editor.js").Draft, life: AbortSignal}} options */
export function settingsForm({ fields, draft, life }) {
  const change = (/** @type {import("./settings.js").Settings} */ patch) => draft.set({ ...draft.value, ...patch });
  const isDrawn = (/** @type {string} */ name) => DRAWN.some((drawn) => name === drawn || name.startsWith(`${drawn}.`));
  const shown = [...fields.values()].filter(({ name, kind }) => kind !== "group" && kind !== "other" && name !== "preset" && !isDrawn(name));
  const controls = shown.map((field) => ({ field, ...control(field, { change, fields }) }));
  const of = (/** @type {boolean} */ isMain) => controls.filter(({ name }) => MAIN.includes(name) === isMain).map(({ node }) => node);
  const presets = element("select", { name: "preset", onchange: () => change({ preset: presets.value || undefined }) }, ...["", ...fields.get("preset")?.choices ?? []].map((name) => element("option", { value: name }, say(`editor.preset.${name || "none"}`))));
  draft.watch((now) => {
    presets.value = now.preset ?? "";
    for (const { field, name, update } of controls) update(now[name] === undefined ? field.default : now[name], { isSet: now[name] !== undefined && !isSame(now[name], field.default) });
  }, life);
  const more = element("details.editor-more", {}, element("summary", {}, say("editor.more")),
    element("label.field", {}, say("editor.preset"), presets, element("small", {}, say("editor.preset.help"))), ...of(false));
  return { main: element("div.editor-settings", {}, ...of(true)), more };
}
