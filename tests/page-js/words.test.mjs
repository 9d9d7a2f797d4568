// The words of the page: both languages have the same keys and values, and each key has a use.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import en from "../../static/words/en.js";
import ja from "../../static/words/ja.js";
import service from "../../static/words/service-ja.js";
import { grouped } from "../../static/js/studio/groups.js";

const STATIC = new URL("../../static/", import.meta.url);
/** Japanese words without a Japanese letter: names, numbers, units and marks. */
const UNTRANSLATED = ["foot.api", "upload.of", "thing.weight.none", "thing.flee_bl.none", "set.format.gif", "set.format.webp", "share.curl", "share.python", "unit.cm", "unit.m", "desk.of_frames", "desk.compass.share", "editor.does.one", "editor.does.and"];

/** Settings of an analysis that are below "More", and those in sight. */
const ANALYSIS = ["view", "follow", "threshold", "sprites", "kappa", "fps", "pixel_aspect", "camera.z_min_m", "camera.pane_px_per_m", "camera.center_px", "camera.medium_index", "animal.length_m", "animal.height_m",
  "scale_mode", "smooth", "clip_frames", "clip_weights", "epsilon", "heading_gate_deg", "planes", "eq7", "axis_and_head"];

const files = readdirSync(STATIC, { recursive: true, withFileTypes: true })
  .filter((file) => file.isFile() && /\.(js|html)$/.test(file.name) && !file.parentPath.endsWith("words"))
  .map((file) => ({ name: file.name, text: readFileSync(`${file.parentPath}/${file.name}`, "utf8") }));
const page = files.map(({ text }) => text).join("\n");

/** Returns all forms of a value. */
const formsOf = (value) => (typeof value === "string" ? [value] : Object.values(value));
/** Returns the names in braces of a value, over all its forms. */
const placesOf = (value) => [...new Set(formsOf(value).flatMap((form) => form.match(/\{\w+\}/g) ?? []))].sort();
/** Returns the names of the entries for which `isWrong` holds. */
const wrong = (table, isWrong) => Object.entries(table).filter(([key, value]) => isWrong(value, key)).map(([key]) => key);

/** Returns the text of the first argument of a call that begins at `start`. */
function firstArgument(text, start) {
  let [depth, quote] = [0, ""];
  for (let at = start; at < text.length; at++) {
    const letter = text[at];
    if (quote) quote = letter === quote ? "" : quote;
    else if (letter === '"' || letter === "`") quote = letter;
    else if ("([{".includes(letter)) depth += 1;
    else if (depth === 0 && ",)".includes(letter)) return text.slice(start, at);
    else if (")]}".includes(letter)) depth -= 1;
  }
  return "";
}

/** Returns the keys and the patterns of keys that the page says. */
function keysSaid() {
  const [keys, patterns] = [new Set(), new Set()];
  for (const [, key] of page.matchAll(/data-say(?:-label)?="([^"]+)"/g)) keys.add(key);
  for (const call of page.matchAll(/(?<![\w.])say(?:Or)?\(/g)) {
    const argument = firstArgument(page, call.index + call[0].length);
    const rest = argument.replace(/`([^`]*)`/g, (_, pattern) => { patterns.add(pattern); return ""; });
    for (const [, key] of rest.replace(/[!=]== "[^"]*"/g, "").matchAll(/"([^"]+)"/g)) keys.add(key);
  }
  return { keys: [...keys], patterns: [...patterns] };
}

/** Returns the keys of a table that fit a pattern such as `tool.${name}.help`. */
const fitting = (pattern, table = en) => {
  const [first, ...rest] = pattern.split(/\$\{[^}]*\}/).map((part) => part.replaceAll(".", "\\."));
  const whole = new RegExp(`^${[first, ...rest].join(".+")}$`);
  return Object.keys(table).filter((key) => whole.test(key));
};

test("both languages have the same keys in the same order", () => {
  assert.deepEqual(Object.keys(ja), Object.keys(en));
});

test("no key stands twice in a table", () => {
  for (const name of ["en", "ja"]) {
    const keys = [...readFileSync(new URL(`words/${name}.js`, STATIC), "utf8").matchAll(/"([\w.]+)": /g)].map(([, key]) => key);
    assert.deepEqual(keys.filter((key, k) => keys.indexOf(key) !== k), [], name);
  }
});

test("both languages have the same values in braces", () => {
  assert.deepEqual(wrong(en, (value, key) => placesOf(value).join() !== placesOf(ja[key] ?? "").join()), []);
});

test("no words are empty", () => {
  for (const table of [en, ja]) assert.deepEqual(wrong(table, (value) => formsOf(value).length === 0 || formsOf(value).some((form) => !form.trim())), []);
});

test("words with plural forms have the form that every number can take", () => {
  for (const table of [en, ja]) assert.deepEqual(wrong(table, (value) => typeof value !== "string" && !value.other), []);
});

test("Japanese words have Japanese letters, except a few names and marks", () => {
  const isForeign = (value) => formsOf(value).some((form) => !/[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u.test(form));
  assert.deepEqual(wrong(ja, isForeign).sort(), [...UNTRANSLATED].sort());
});

test("English sentences are short", () => {
  const sentences = (form) => form.split(/(?<=[.:;!?]) /);
  assert.deepEqual(wrong(en, (value, key) => key !== "desk.keys" && formsOf(value).some((form) => sentences(form).some((one) => one.split(" ").length > 25))), []);
});

test("every key that the page says exists", () => {
  const { keys, patterns } = keysSaid();
  assert.ok(keys.length > 100 && patterns.length > 20, "the calls of say are found");
  assert.deepEqual(keys.filter((key) => !(key in en)), []);
  assert.deepEqual(patterns.filter((pattern) => fitting(pattern, { ...en, ...service }).length === 0), []);
});

test("Japanese words for what the service says have no Latin letters", () => {
  assert.deepEqual(wrong(service, (value) => /\p{Script=Latin}/u.test(value) || !/[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u.test(value)), []);
});

test("Japanese words exist for reasons to refuse and for the help of settings", () => {
  const codes = [...readFileSync(new URL("../docs/reference/errors.md", STATIC), "utf8").matchAll(/^\| `(\w+)` \|/gm)].map(([, code]) => code);
  const told = Object.keys(service).filter((key) => key.startsWith("code."));
  assert.ok(told.length >= 60);
  assert.deepEqual(told.filter((key) => !codes.includes(key.split(".")[1]) || !(key.replace(/^(code\.\w+)$/, "$1.advice") in service)), []);
  const settings = [...Object.values(grouped({ has: () => true, values: () => [] })).flat(), "palette", "swim", "bank_rad", "smooth_s", "bridge_s", "length_m", "height_m", ...ANALYSIS];
  assert.ok(settings.length > 40);
  assert.deepEqual(settings.filter((name) => Number(`hint.${name}` in ja) + Number(`hint.${name}` in service) !== 1), []);
});

test("the page says every key", () => {
  const used = new Set(keysSaid().patterns.flatMap((pattern) => fitting(pattern)));
  // Some keys go through a variable before they are said.
  assert.deepEqual(Object.keys(en).filter((key) => !used.has(key) && !page.includes(`"${key}"`)), []);
});

test("the page shows the English words before its script runs", () => {
  const shown = [...page.matchAll(/data-say="([^"]+)"[^>]*>([^<]+)</g)];
  assert.ok(shown.length > 5);
  assert.deepEqual(shown.filter(([, key, text]) => en[key] !== text).map(([, key]) => key), []);
});
