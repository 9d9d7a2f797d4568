// The part of the panel in which each setting is. Settings that the service has and this table lacks are shown among
// the fine adjustments.
// @ts-check

const MAIN = ["count", "frames"];
const MORE = ["seed", "loop"];
const MOVE = ["rules.sociality", "rules.alignment", "rules.cohesion", "rules.separation", "rules.wander", "rules.circling", "rules.walls", "spacing_bl", "leaders", "variation", "depth_bl", "position", "tank"];
const FINE = ["rules.separation_bl", "rules.alignment_bl", "rules.cohesion_bl", "rules.picture_separation_bl", "rules.view_deg", "rules.neighbors", "separation", "mirror", "dwell_frames", "fade_frames"];
const ZONES = ["rules.zones.repulsion_bl", "rules.zones.orientation_bl", "rules.zones.attraction_bl", "rules.zones.noise_rad"];
const MATCHING = ["matching.by", "matching.w_h", "matching.w_v", "matching.rho_deg", "matching.w_r", "matching.w_c", "matching.wx", "matching.w_p", "matching.w_d", "matching.segment_frames"];
const LOOK = ["render.haze_per_bl", "render.shadow", "render.cut"];
const FILES = ["render.ground_truth", "render.overlay"];
/** Settings with controls of their own. */
const OWN = ["preset", "goals", "obstacles", "predator", "render.background", "render.size_px", "render.formats"];
/** Rules that the three zones replace. */
const REPLACED = ["rules.sociality", "rules.separation", "rules.alignment", "rules.cohesion", "rules.circling", "rules.wander", "rules.separation_bl", "rules.alignment_bl", "rules.cohesion_bl"];

/**
 * Returns the names of a service's settings by the part of the panel.
 * @param {import("./schema.js").Fields} fields
 */
export function grouped(fields) {
  const names = [...fields.values()].filter(({ kind }) => kind !== "group" && kind !== "other").map(({ name }) => name);
  const placed = new Set([MAIN, MORE, MOVE, FINE, LOOK, FILES, OWN, ZONES, MATCHING].flat());
  const known = (/** @type {string[]} */ list) => list.filter((name) => fields.has(name));
  return { main: known(MAIN), more: known(MORE), move: known(MOVE), fine: [...known(FINE), ...names.filter((name) => !placed.has(name))], zones: known(ZONES), matching: known(MATCHING), look: known(LOOK), files: known(FILES) };
}

/** Returns whether a setting is void under others. @param {string} name @param {(name: string) => any} value of another setting */
export function isIdle(name, value) {
  if (REPLACED.includes(name)) return value("rules.zones") != null;
  return name === "variation" && value("loop") === true;
}
