// The shapes of all individuals in one frame, each in its color: the sprites of the atlas, filled and drawn
// from far to near at the places of the ground truth.
// @ts-check

/** Colors of neighboring ids differ: the hue goes on by the golden angle. */
const GOLDEN_DEG = 137.508;

/** @param {number} id */
export const colorOf = (id) => `hsl(${((id * GOLDEN_DEG) % 360).toFixed(0)} 90% 66%)`;

/**
 * Returns a function that draws the shapes of a frame. @param {import("../flock/plan.js").Plan} plan @param {import("../flock/atlas.js").Atlas} atlas
 */
export function shapesOf(plan, atlas) {
  const indices = new Map(plan.head.individuals.map((one, i) => [one.id, i]));
  const scratch = /** @type {HTMLCanvasElement} */ (document.createElement("canvas"));
  const pen = /** @type {CanvasRenderingContext2D} */ (scratch.getContext("2d"));

  /** @param {import("../flock/atlas.js").Sprite} sprite @param {string} color */
  function fill({ page, x, y, w, h }, color) {
    // A larger canvas than needed is cheaper than one that changes its size.
    if (scratch.width < w || scratch.height < h) [scratch.width, scratch.height] = [Math.max(scratch.width, w), Math.max(scratch.height, h)];
    pen.globalCompositeOperation = "source-over";
    pen.clearRect(0, 0, w, h);
    pen.drawImage(atlas.pages[page], x, y, w, h, 0, 0, w, h);
    pen.globalCompositeOperation = "source-in";
    pen.fillStyle = color;
    pen.fillRect(0, 0, w, h);
  }

  return (/** @type {CanvasRenderingContext2D} */ context, /** @type {number} */ frame, /** @type {import("./tracks.js").Track[]} */ tracks) => {
    if (frame >= plan.nFrames) return;
    const shown = tracks.flatMap((track) => {
      const i = indices.get(track.id);
      if (i === undefined) return [];
      const cell = plan.cell(i, frame);
      const fade = plan.fadeAt(i, frame);
      // The second sprite of a fade has the pixel from a half.
      const look = fade && fade.weight > 0.5 ? fade : cell;
      const sprite = atlas.spriteOf(look.sourceFrame);
      return sprite ? [{ track, look, sprite, depth: cell.depth, zoom: (look.scale * track.scale) / cell.scale / atlas.scale }] : [];
    });
    shown.sort((a, b) => b.depth - a.depth);
    for (const { track, look, sprite, zoom } of shown) {
      fill(sprite, colorOf(track.id));
      context.save();
      context.translate(track.x, track.y);
      context.rotate(look.rotation);
      context.scale(look.mirrored ? -zoom : zoom, zoom);
      context.drawImage(scratch, 0, 0, sprite.w, sprite.h, sprite.x - sprite.cx, sprite.y - sprite.cy, sprite.w, sprite.h);
      context.restore();
    }
  };
}
