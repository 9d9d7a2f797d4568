// The numbers of a measurement in plain words, alone or beside those of another measurement of the same film.
// @ts-check
import { element } from "../app/element.js";
import { count, percent, say, sayOr, seconds } from "../app/words.js";

/** @typedef {{key: string, value: string, values?: import("../app/words.js").Values}} Row */
/** @typedef {{library: Api.Library, head?: Api.PosesHead | null, px_per_cm?: number | null}} Measured head is null until it is loaded */

/**
 * Returns the numbers: the key of the words, the value as text, and values for the words.
 * @param {Measured} measured @returns {Row[]}
 */
function numbersOf({ library, head = null, px_per_cm = library.px_per_cm }) {
  const beat = head?.tail_beat?.spans?.[0];
  /** @type {(Row | false | null | undefined | 0)[]} */
  const rows = [
    { key: "frames", value: count(library.n_frames), values: { time: seconds(library.n_frames / library.fps), fps: library.fps } },
    { key: "seen", value: percent(library.detected_share) },
    { key: "view", value: say(`desk.view.${library.view}`) },
    library.length_px && { key: "length", value: px_per_cm ? say("unit.cm", { n: library.length_px / px_per_cm }) : say("unit.px", { n: library.length_px }) },
    beat && { key: "tail_beat", value: say("unit.hz", { n: beat.frequency_hz }) },
    { key: "jumps", value: count(library.n_transitions) },
    { key: "endless", value: percent(library.component_share) },
  ];
  return rows.flatMap((row) => row || []);
}

/** Returns the list of numbers with what they mean. @param {Measured} measured */
export const numberList = (measured) => element("dl.numbers", {}, ...numbersOf(measured).map(({ key, value, values }) => element("div", {}, element("dt", {}, say(`desk.number.${key}`), element("small", {}, say(`desk.number.${key}.means`, values))), element("dd", {}, value))));

/** Returns a table of two measurements side by side; rows that differ are marked. @param {Measured} before @param {Measured} after */
export function comparison(before, after) {
  const [old, now] = [before, after].map(numbersOf);
  const rows = now.map(({ key, value }) => {
    const former = old.find((one) => one.key === key)?.value ?? "–";
    return element("tr", { className: former === value ? "" : "changed" }, element("th", { scope: "row" }, say(`desk.number.${key}`)), element("td", {}, former), element("td", {}, value));
  });
  const settings = settingRows(before.library.params ?? {}, after.library.params ?? {});
  const heads = ["what", "before", "after"].map((name) => element("th", { scope: "col" }, say(`desk.compare.${name}`)));
  return element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("desk.compare.title") }, element("table.comparison", {}, element("caption.unseen", {}, say("desk.compare.title")), element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...settings, ...rows)));
}

/** Returns the words for a setting. @param {string} name */
export const settingName = (name) => sayOr(`set.${name}`, name);

/** Returns a row for each setting that differs. @param {Record<string, unknown>} before @param {Record<string, unknown>} after */
function settingRows(before, after) {
  const names = Object.keys(after).filter((name) => JSON.stringify(before[name] ?? null) !== JSON.stringify(after[name] ?? null));
  return names.map((name) => element("tr.changed", {}, element("th", { scope: "row" }, settingName(name), " ", element("small", {}, say("desk.compare.setting"))), ...[before, after].map((params) => element("td", {}, settingWords(name, params[name])))));
}

/** Returns the value of a setting in words. @param {string} name @param {any} value */
export function settingWords(name, value) {
  if (value === null || value === undefined) return sayOr(`set.${name}.null`, "–");
  const exact = (/** @type {number} */ one) => String(Number(one.toPrecision(4)));
  if (name === "camera") return say("desk.compare.camera", { cm: exact(100 * value.z_min_m), px: exact(value.pane_px_per_m / 100) });
  if (name === "animal") return say("desk.compare.animal", { length: exact(100 * value.length_m), height: exact(100 * value.height_m) });
  if (name === "ignore") return count(value.length);
  if (name === "animal_at" || name === "head") return say("desk.compare.point", { at: (value.at_px ?? value.point).map(Math.round).join(", "), frame: String(value.frame) });
  if (name === "from_s" || name === "to_s") return seconds(value);
  return sayOr(`set.${name}.${value}`, typeof value === "object" ? JSON.stringify(value) : String(value));
}
