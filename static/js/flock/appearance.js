// What one frame shows: the sprites of all individuals with their places, from far to near.
// @ts-check

/**
 * @typedef {import("./plan.js").Look} Look
 * @typedef {{sprite: import("./atlas.js").Sprite, rotation: number, scale: number, mirrored: boolean}} Shown
 * @typedef {{x: number, y: number, depth: number, main: Shown, second: Shown | null, weight: number}} Appearance
 *   the picture is (1 - weight) * main + weight * second, both with their centroid at x, y
 * @typedef {{fps: number, nFrames: number, span: number, isLive?: boolean, at: (t: number) => Appearance[]}} Source
 *   frames to play. `span`: frames of the time line, more than `nFrames` while only the beginning is planned.
 *   Live: the play head rests meanwhile; `at` returns another list only if something has changed
 */

/** What stands behind a transparent flock, as behind its film: pixels of a square, and two grays from 0 to 1. */
export const CHECKERS = { side: 16, grays: [0.706, 0.561] };

/** @param {import("./plan.js").Plan} plan @param {import("./atlas.js").Atlas} atlas @returns {Source} */
export function planSource(plan, atlas) {
  const { nFrames, nIndividuals, fps } = plan;
  const asked = plan.head.params?.frames ?? nFrames;
  return {
    fps, nFrames, span: asked > nFrames ? asked : nFrames,
    at: (t) => farToNear(Array.from({ length: nIndividuals }, (_, i) => {
      const cell = plan.cell(i, t);
      return appearance(atlas, cell, cell, plan.fadeAt(i, t));
    })),
  };
}

/**
 * Returns one individual; null if the atlas lacks its sprite.
 * @param {import("./atlas.js").Atlas} atlas @param {{x: number, y: number, depth: number}} place @param {Look} look
 * @param {Look & {weight: number} | null} fade @returns {Appearance | null}
 */
export function appearance(atlas, { x, y, depth }, look, fade) {
  const [main, second] = [look, fade].map((one) => {
    const sprite = one && atlas.spriteOf(one.sourceFrame);
    return sprite ? { sprite, rotation: one.rotation, scale: one.scale, mirrored: one.mirrored } : null;
  });
  return main && { x, y, depth, main, second, weight: fade && second ? Math.min(1, Math.max(0, fade.weight)) : 0 };
}

/**
 * Sorts as the film is composited: at equal depth the larger index is nearer.
 * @param {(Appearance | null)[]} all @returns {Appearance[]}
 */
export const farToNear = (all) => all.flatMap((one) => one ?? []).sort((a, b) => b.depth - a.depth);

/** Returns the share of its color that an animal keeps in the haze. @param {{perBl: number, lengthPx: number}} haze @param {number} depth */
export const keptColor = ({ perBl, lengthPx }, depth) => (1 - perBl) ** (Math.max(0, depth) / lengthPx);
