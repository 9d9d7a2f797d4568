// Settings that a transparent background changes, too: it adds a film format with transparency, and lets the flock move
// in the whole picture instead of the area where the animal was filmed. Changes by the person come first.
// @ts-check
import { CLEAR } from "./ways.js";

/** @typedef {import("./settings.js").Settings} Settings */

const BACKGROUND = "render.background", FORMATS = "render.formats", TANK = "tank";
/** The format that is added if the files have none with transparency, as video.mp4 has none. */
const ADDED = "webm";

/** Returns the settings that a transparent background changes. @param {import("./schema.js").Fields} fields @returns {Settings} */
const implied = (fields) => ({ [FORMATS]: [...fields.get(FORMATS)?.default ?? [], ADDED], ...(fields.has(TANK) ? { [TANK]: "picture" } : {}) });

/** Returns whether a setting has the value that a transparent background gives it. @param {string} name @param {import("./schema.js").Fields} fields @param {(name: string) => any} valueOf */
export const isImplied = (name, fields, valueOf) => name in implied(fields) && valueOf(BACKGROUND) === "transparent" && String(valueOf(name)) === String(implied(fields)[name]);

/** Returns the other settings to change when the background is changed to `next`. @param {string} next @param {import("./schema.js").Fields} fields @param {(name: string) => any} valueOf @returns {Settings} */
export function impliedChanges(next, fields, valueOf) {
  if (next !== "transparent") return Object.fromEntries(Object.keys(implied(fields)).filter((name) => isImplied(name, fields, valueOf)).map((name) => [name, undefined]));
  const formats = valueOf(FORMATS) ?? [];
  const isBare = !formats.some((/** @type {string} */ one) => CLEAR.includes(one));
  const isFree = fields.has(TANK) && valueOf(TANK) === fields.get(TANK)?.default;
  return { ...(isBare ? { [FORMATS]: [...formats, ADDED] } : {}), ...(isFree ? { [TANK]: "picture" } : {}) };
}
