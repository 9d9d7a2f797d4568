// Ranges of the sliders, and limits of settings for a service whose /openapi.json has them only in prose.
// @ts-check

/** Most individuals times frames of a preview. */
export const PREVIEW_CELLS = 200_000;
/** Individuals times frames above which a preview of the beginning is asked for first, and its frames. */
export const FIRST_CELLS = 20_000;
export const FIRST_FRAMES = 60;
/** Most individuals times frames of a flock, and frames of a loop. */
const MOST_CELLS = 4_000_000;
const LOOP_FRAMES = [30, 5000];
/** Most frames of a flock that does not keep the animal's own steps (`position` other than `film`). */
const STEERED_FRAMES = 10_000;

/** Ranges that sliders offer; a number field takes the rest. Free choices around the useful values. */
export const USUAL = {
  "flocks": [1, 200], "pictures": [1, 500], "every": [1, 60], "backgrounds.plate": [0, 5], "backgrounds.color": [0, 5],
  "count": [1, 120], "frames": [30, 1800], "rules.separation": [0, 6], "rules.alignment": [0, 6], "rules.cohesion": [0, 4],
  "rules.walls": [0, 12], "rules.wander": [0, 4], "rules.circling": [0, 4], "rules.separation_bl": [0.1, 8],
  "rules.picture_separation_bl": [0, 4], "rules.alignment_bl": [0.1, 15], "rules.cohesion_bl": [0.1, 20], "rules.neighbors": [1, 64],
  "rules.zones.repulsion_bl": [0.1, 5], "rules.zones.orientation_bl": [0, 20], "rules.zones.attraction_bl": [0, 30],
  "depth_bl": [0, 12], "spacing_bl": [0.2, 6], "matching.segment_frames": [2, 300], "render.haze_per_bl": [0, 0.5],
  "threshold": [1, 100], "fps": [1, 240], "pixel_aspect": [0.5, 2], "clip_frames": [2, 40], "kappa": [1, 6], "epsilon": [0, 1e6],
  "camera.z_min_m": [0.1, 3], "camera.pane_px_per_m": [100, 10_000], "camera.medium_index": [1, 1.5], "animal.length_m": [0.005, 1], "animal.height_m": [0.002, 0.5],
};

/** Least and most of settings whose schema lacks them. It can go when every service tells them as data. */
const PROSE = {
  "count": [1, 10_000], "frames": [1, 1_000_000], "spacing_bl": [0.2, 10], "depth_bl": [0, 100], "variation": [0, 0.3],
  "dwell_frames": [1, 120], "fade_frames": [0, 16], "rules.view_deg": [1, 360], "rules.neighbors": [1, 2000],
  "rules.picture_separation_bl": [0, 50], "rules.zones.orientation_bl": [0, 50], "rules.zones.attraction_bl": [0, 50],
  "rules.sociality": [0, 1], "rules.zones.noise_rad": [0, 1], "matching.rho_deg": [0, 45], "matching.w_d": [0, 1], "matching.segment_frames": [2, 2000],
  "render.haze_per_bl": [0, 1], "render.shadow": [0, 1],
};

/** @param {string} name @returns {number[]} least and most */
export function proseLimits(name) {
  const known = /** @type {Record<string, number[]>} */ (PROSE)[name];
  if (known) return known;
  if (name.startsWith("matching.")) return [0, 4];
  return name.endsWith("_bl") ? [0.1, 50] : [0, 20];
}

/** Returns the least and most frames beside the other settings. @param {{loop?: boolean, position?: string}} params those in force @param {number} n individuals */
export function frameLimits({ loop = false, position = "film" } = {}, n = 1) {
  const most = Math.floor(MOST_CELLS / Math.max(1, n));
  if (loop) return [LOOP_FRAMES[0], Math.min(LOOP_FRAMES[1], most)];
  return [1, Math.min(position === "film" ? 1_000_000 : STEERED_FRAMES, most)];
}

/** Returns the most individuals beside the other settings. @param {number} frames */
export const mostCount = (frames) => Math.min(10_000, Math.floor(MOST_CELLS / Math.max(1, frames)));
