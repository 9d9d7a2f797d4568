// The settings of a measurement by the names of the API, with dots between levels; those that a person draws are whole.
// @ts-check
import { bodyOf } from "../studio/settings.js";

/** @typedef {import("../studio/settings.js").Settings} Settings @typedef {import("../studio/schema.js").Fields} Fields */

/** Settings that a person draws on the picture or on the axis of the film. */
export const DRAWN = ["animal_at", "head", "ignore", "from_s", "to_s"];

/** Returns parameters of the service as settings, without their defaults and without those that it no longer knows. @param {Record<string, any>} params @param {Fields} fields */
export function settingsOf(params, fields) {
  /** @type {Settings} */
  const settings = {};
  const put = (/** @type {string} */ name, /** @type {any} */ value) => {
    const field = fields.get(name);
    if (!field || value === undefined || isSame(value, field.default)) return;
    if (field.kind === "group" && value && !DRAWN.includes(name)) for (const [key, inner] of Object.entries(value)) put(`${name}.${key}`, inner);
    else settings[name] = value;
  };
  for (const [name, value] of Object.entries(params)) put(name, value);
  return settings;
}

/**
 * Returns what a request sends: the settings that differ from the defaults. A preset replaces the defaults, so all
 * settings are sent besides it. @param {Settings} settings @param {Fields} fields @returns {Api.AnalysisChanges}
 */
export const changesOf = (settings, fields) => /** @type {any} */ (bodyOf(Object.fromEntries(changed(settings, fields))));

/** @param {Settings} settings @param {Fields} fields */
export const changed = (settings, fields) => Object.entries(settings).filter(([name, value]) => value !== undefined && (settings.preset ? value !== null || name !== "preset" : !isSame(value, fields.get(name)?.default)));

/** @param {unknown} a @param {unknown} b */
export const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
