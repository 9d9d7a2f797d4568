// Sentences, numbers, dates and directions in the language of the person. Angles are converted to degrees
// only here.
// @ts-check
/** @typedef {Record<string, string | number>} Values */

const KNOWN = ["en", "ja"];

/** Returns the language to show: the one chosen earlier, else the browser's first known one. */
function chosen() {
  const asked = new URLSearchParams(location.search).get("lang") ?? localStorage.getItem("flockreel-language");
  const all = [asked, ...navigator.languages].map((tag) => (tag ?? "").slice(0, 2));
  return all.find((tag) => KNOWN.includes(tag)) ?? "en";
}

export const language = chosen();
/** @type {Record<string, string | Record<string, string>>} */
const table = (await import(`../../words/${language}.js`)).default;
document.documentElement.lang = language;

/** Changes the language and loads the page again. @param {string} tag */
export function setLanguage(tag) {
  localStorage.setItem("flockreel-language", tag);
  const address = new URL(location.href);
  address.searchParams.delete("lang");
  location.replace(address);
}

const plural = new Intl.PluralRules(language);
const number = new Intl.NumberFormat(language, { maximumFractionDigits: 1 });
const whole = new Intl.NumberFormat(language, { maximumFractionDigits: 0 });
const share = new Intl.NumberFormat(language, { style: "percent", maximumFractionDigits: 0 });
const date = new Intl.DateTimeFormat(language, { dateStyle: "medium", timeStyle: "short" });
const relative = new Intl.RelativeTimeFormat(language, { numeric: "auto" });

/**
 * Returns the sentence of a key. `{name}` stands for a value. A sentence with plural forms is an object
 * {one, other} and is chosen by the value `n`.
 * @param {string} key @param {Values} [values]
 */
export function say(key, values = {}) {
  const found = table[key];
  if (found === undefined) throw new Error(`no words for ${key}`);
  const sentence = typeof found === "string" ? found : found[plural.select(Number(values.n))] ?? found.other;
  return sentence.replace(/\{(\w+)\}/g, (/** @type {string} */ _, /** @type {string} */ name) => {
    const value = values[name];
    return typeof value === "number" ? number.format(value) : String(value ?? "");
  });
}

/** @type {Promise<unknown> | undefined} */
let ofService;
/** Adds words for what the service says in English only. Without them, its own words are shown. */
export function wordsOfService() {
  ofService ??= language === "en" ? Promise.resolve() : import(`../../words/service-${language}.js`).then((words) => Object.assign(table, words.default)).catch(() => { ofService = undefined; });
  return ofService;
}

/** Returns the sentence of a key, or `other` if there is none. @param {string} key @param {string} other @param {Values} [values] */
export const sayOr = (key, other, values) => (table[key] ? say(key, values) : other);

/** @param {number} value */
export const count = (value) => number.format(value);
/** @param {number} part */
export const percent = (part) => share.format(part);
/** @param {number} rad */
export const degrees = (rad) => (rad * 180) / Math.PI;
/** @param {number} value */
export const seconds = (value) => say("unit.seconds", { n: value });
/** @param {number} bytes */
export const size = (bytes) => (bytes < 1e6 ? `${whole.format(Math.max(1, bytes / 1e3))} kB` : bytes < 1e9 ? `${number.format(bytes / 1e6)} MB` : `${number.format(bytes / 1e9)} GB`);
/** @param {string | null} time */
export const day = (time) => (time ? date.format(new Date(time)) : "");

/** Returns a time as "3 minutes ago". @param {string} time */
export function ago(time) {
  const elapsed_s = (Date.now() - Date.parse(time)) / 1000;
  /** @type {[number, Intl.RelativeTimeFormatUnit][]} */
  const units = [[60, "second"], [60, "minute"], [24, "hour"], [30, "day"], [12, "month"], [Infinity, "year"]];
  let value = elapsed_s;
  for (const [limit, unit] of units) {
    if (Math.abs(value) < limit) return relative.format(-Math.round(value), unit);
    value /= limit;
  }
  return "";
}

/** Returns a duration such as "0:07" or "12:30". @param {number} time_s */
export function clock(time_s) {
  const total = Math.max(0, time_s);
  const rest = Math.floor(total % 60);
  return `${Math.floor(total / 60)}:${String(rest).padStart(2, "0")}`;
}

const EIGHTHS = ["right", "down_right", "down", "down_left", "left", "up_left", "up", "up_right"];

/** Returns the direction of a heading as text, such as "down right". @param {number} heading_rad */
export function direction(heading_rad) {
  const eighth = ((Math.round(degrees(heading_rad) / 45) % 8) + 8) % 8;
  return say(`direction.${EIGHTHS[eighth]}`);
}

/** Returns a heading as text, such as "34° (down right)". @param {number} heading_rad */
export const heading = (heading_rad) => `${whole.format(degrees(heading_rad)).replace("-", "−")}° (${direction(heading_rad)})`;

/** Progress of a job from which all is computed, and only its files are being written. */
export const COMPUTED = 0.995;

/** Returns the state of a job as text, while it runs with its stage and progress. @param {Api.Job} job */
export function stageOf(job) {
  if (job.state !== "running") return say(`state.${job.state}`);
  if (job.cancel_requested) return say("state.cancelling");
  if (job.progress >= COMPUTED) return say("stage.files");
  return `${sayOr(`stage.${job.stage ?? "starting"}`, say("stage.starting"))} · ${percent(job.progress)}`;
}
