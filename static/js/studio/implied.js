// What a transparent background brings along until a person decides otherwise: a film that keeps transparency, and
// motion in the whole picture, because the place where the animal was filmed is no longer seen.
// @ts-check
import { CLEAR } from "./ways.js";

/** @typedef {import("./settings.js").Settings} Settings */

const BACKGROUND = "render.background", FORMATS = "render.formats", TANK = "tank";
/** The format that is added if the files have none with transparency, as video.mp4 has none. */
const ADDED = "webm";

/** Returns the settings that come along. @param {import("./schema.js").Fields} fields @returns {Settings} */
const implied = (fields) => ({ [FORMATS]: [...fields.get(FORMATS)?.default ?? [], ADDED], ...(fields.has(TANK) ? { [TANK]: "picture" } : {}) });

/** Returns whether a setting has its value by the background alone. @param {string} name @param {import("./schema.js").Fields} fields @param {(name: string) => any} valueOf */
export const isImplied = (name, fields, valueOf) => valueOf(BACKGROUND) === "transparent" && String(valueOf(name)) === String(implied(fields)[name]);

/** Returns what another background changes with it. @param {string} next @param {import("./schema.js").Fields} fields @param {(name: string) => any} valueOf @returns {Settings} */
export function broughtAlong(next, fields, valueOf) {
  if (next !== "transparent") return Object.fromEntries(Object.keys(implied(fields)).filter((name) => isImplied(name, fields, valueOf)).map((name) => [name, undefined]));
  const formats = valueOf(FORMATS) ?? [];
  const isBare = !formats.some((/** @type {string} */ one) => CLEAR.includes(one));
  const isFree = fields.has(TANK) && valueOf(TANK) === fields.get(TANK)?.default;
  return { ...(isBare ? { [FORMATS]: [...formats, ADDED] } : {}), ...(isFree ? { [TANK]: "picture" } : {}) };
}
