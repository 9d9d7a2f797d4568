// The settings of a flock that was made, as a link to the studio, and the names of its files.
// @ts-check
import { at, writeQuery } from "../studio/settings.js";
import { OFFERED, SHARED } from "./shared-link.js";

/**
 * Returns the settings of a flock that differ from the defaults, as the studio names them.
 * @param {Api.FlockParams} params of the flock @param {import("../studio/schema.js").Fields} fields
 */
export function changedOf(params, fields) {
  /** @type {import("../studio/settings.js").Settings} */
  const changed = {};
  for (const [name, field] of fields) {
    const value = at(params, name);
    if (value === undefined) continue;
    if (field.kind !== "group") {
      // A member of a group that is absent unless it is set has the default of that group.
      if (!isSame(value, field.default)) changed[name] = value;
    } else if (field.default === null && value !== null && field.nullable) changed[name] = {};
  }
  return changed;
}

/** @param {unknown} a @param {unknown} b */
const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/** Returns the address of the studio with the settings of a flock. @param {Api.Flock} flock @param {import("../studio/schema.js").Fields} fields */
export function studioAddress(flock, fields) {
  const query = writeQuery(changedOf(flock.params, fields));
  return `/libraries/${flock.library_id}/studio${query && `?${query}`}`;
}

/** Files by the format that makes them. */
const OF_FORMAT = { webm: "video.webm", mov: "video.mov", png: "frames.zip", gif: "preview.gif", webp: "preview.webp", poster: "poster.png" };

/** Returns the place of a file in lists: films first. @param {string} name */
const rank = (name) => ["video.mp4", ...Object.values(OF_FORMAT), name].indexOf(name);

/** Returns the names of the files of a flock, in the order of use. @param {Api.Flock} flock @returns {string[]} */
export function filesOf(flock) {
  if (flock.files) return flock.files.map((file) => file.name).sort((a, b) => rank(a) - rank(b));
  const { formats = [], overlay = false, ground_truth = true } = flock.params.render ?? {};
  const wanted = Object.entries(OF_FORMAT).flatMap(([format, name]) => (formats.some((one) => one === format) ? [name] : []));
  return ["video.mp4", ...wanted, ...(overlay ? ["overlay.mp4"] : []), ...(ground_truth ? ["tracks.csv", "ground-truth.zip"] : []), "flock.json", "flock.plan", "plan.svg"];
}

/** Returns the names of the transparent films of a transparent flock. @param {Api.Flock} flock */
const clearFilesOf = (flock) => (flock.params.render?.background === "transparent" ? Object.values(OFFERED).filter((name) => filesOf(flock).includes(name)) : []);

/** Returns the name of the film that a person expects. @param {Api.Flock} flock */
export const filmFileOf = (flock) => clearFilesOf(flock)[0] ?? "video.mp4";

/** Returns the name of the film that a browser shows: a transparent one if it can. @param {Api.Flock} flock */
export const shownFileOf = (flock) => (clearFilesOf(flock).includes(OFFERED.webm) ? OFFERED.webm : "video.mp4");

/** Returns the names of the files that a link for friends opens. @param {Api.Flock} flock @returns {string[]} */
export const sharedFilesOf = (flock) => [...SHARED, ...clearFilesOf(flock)];

/** Returns the name under which a file is saved, such as "goldfish_20x400_s1.mp4". @param {string} name @param {Api.Flock} flock @param {string} film */
export function savedName(name, { count, frames, seed }, film) {
  const stem = `${film.replace(/[^\p{L}\p{N}._-]+/gu, "-").replace(/^[-.]+|-+$/g, "") || "flock"}_${count}x${frames}_s${seed}`;
  return /^(video|flock)\./.test(name) ? stem + name.slice(name.indexOf(".")) : `${stem}_${name}`;
}
