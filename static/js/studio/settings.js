// The settings of a flock as a query, so that a link is a flock, and their history.
// @ts-check
import { signal } from "../app/store.js";

/**
 * @typedef {Record<string, any>} Settings by the names of the API with dots; only those that differ from the preset
 * @typedef {(patch: Settings, options?: {step?: string, isGesture?: boolean}) => void} Change
 */

/** Names in the address that are no settings. */
const OTHERS = ["t", "lang"];
/** Time within which changes of one setting are one step of the history, ms. Free choice. */
const ONE_STEP_MS = 800;

/**
 * Reads settings. Names that the service does not know are told apart, so that they can be shown.
 * @param {URLSearchParams} query @param {import("./schema.js").Fields} fields
 */
export function readQuery(query, fields) {
  /** @type {Settings} */
  const settings = {};
  /** @type {string[]} */
  const unknown = [];
  const put = (/** @type {string} */ name, /** @type {unknown} */ value) => {
    const field = fields.get(name);
    if (!field) unknown.push(name);
    else if (field.kind === "group" && value && typeof value === "object" && Object.keys(value).length) {
      for (const [key, inner] of Object.entries(value)) put(`${name}.${key}`, inner);
    } else settings[name] = value;
  };
  for (const [name, text] of query) if (!OTHERS.includes(name)) put(name, valueOf(text));
  return { settings, unknown };
}

/** @param {string} text JSON, or a bare word */
function valueOf(text) {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

/** Returns a value as it stands in the query and after `--set`: bare words where JSON allows it. @param {unknown} value */
export const textOf = (value) => (typeof value === "string" && valueOf(value) === value ? value : JSON.stringify(value));

/** @param {Settings} settings */
export const writeQuery = (settings) => new URLSearchParams(Object.entries(settings).map(([name, value]) => [name, textOf(value)])).toString();

/** Returns the settings as the body of a request. @param {Settings} settings @returns {Api.FlockChanges} */
export function bodyOf(settings) {
  /** @type {any} */
  const body = {};
  // A group set as a whole, such as `rules.zones`, comes before its members.
  for (const name of Object.keys(settings).sort((a, b) => a.length - b.length)) {
    const path = name.split(".");
    const last = /** @type {string} */ (path.pop());
    let at = body;
    for (const step of path) at = at[step] ??= {};
    at[last] = structuredClone(settings[name]);
  }
  return body;
}

/** Returns a parameter by its name. @param {any} params of any shape @param {string} name */
export const at = (params, name) => name.split(".").reduce((value, key) => value?.[key], params);

/**
 * Settings with undo and redo.
 * @param {Settings} start
 */
export function createSettings(start) {
  const now = signal(start);
  /** @type {Settings[]} */
  let past = [];
  /** @type {Settings[]} */
  let future = [];
  let [lastStep, lastTime] = ["", 0];
  return {
    now,
    get before() { return past.at(-1); },
    get canUndo() { return past.length > 0; },
    get canRedo() { return future.length > 0; },
    /**
     * Changes settings; undefined takes one away. Changes with the same `step` that follow quickly are undone together.
     * @param {Settings} patch @param {{step?: string, isGesture?: boolean}} [options] a gesture is one step however long it takes
     */
    change(patch, { step = Object.keys(patch).join(), isGesture = false } = {}) {
      const next = { ...now.value, ...patch };
      for (const [name, value] of Object.entries(next)) if (value === undefined) delete next[name];
      if (writeQuery(next) === writeQuery(now.value)) return;
      const joins = step === lastStep && (isGesture || performance.now() - lastTime < ONE_STEP_MS);
      [lastStep, lastTime] = [step, performance.now()];
      if (!joins) past.push(now.value);
      future = [];
      now.set(next);
    },
    undo() {
      const former = past.pop();
      if (!former) return;
      future.push(now.value);
      lastStep = "";
      now.set(former);
    },
    redo() {
      const next = future.pop();
      if (!next) return;
      past.push(now.value);
      lastStep = "";
      now.set(next);
    },
  };
}
