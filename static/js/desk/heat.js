// A heat map: how long the animal was at each place of the picture.
// @ts-check

/** Cells along the longer side of the picture. */
const CELLS = 96;

/**
 * Returns the time in each cell of a grid over the picture, smoothed once, as a share of the longest.
 * @param {import("./columns.js").Columns} columns @param {number[]} size pixels of the film
 */
export function heatOf({ n, centroid_px: at }, size) {
  const cell_px = Math.max(...size) / CELLS;
  const [width, height] = size.map((side) => Math.max(1, Math.ceil(side / cell_px)));
  const inside = (/** @type {number} */ k, /** @type {number} */ most) => Math.min(most - 1, Math.max(0, Math.floor(k / cell_px)));
  const heat = new Float32Array(width * height);
  for (let k = 0; k < n; k++) if (!Number.isNaN(at[2 * k])) heat[inside(at[2 * k + 1], height) * width + inside(at[2 * k], width)] += 1;
  const smooth = heat.map((_, cell) => {
    const [x, y] = [cell % width, Math.floor(cell / width)];
    let [sum, weights] = [0, 0];
    for (let dy = -1; dy <= 1; dy++) for (let dx = -1; dx <= 1; dx++) {
      if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
      const weight = (2 - Math.abs(dx)) * (2 - Math.abs(dy));
      sum += weight * heat[cell + dy * width + dx];
      weights += weight;
    }
    return sum / weights;
  });
  const most = smooth.reduce((a, b) => Math.max(a, b), 0) || 1;
  return { width, height, cell_px, share: smooth.map((one) => one / most) };
}

/**
 * Draws the map over the picture: the longer the animal was at a place, the more opaque and the warmer.
 * @param {CanvasRenderingContext2D} context scaled to pixels of the film
 * @param {ReturnType<typeof heatOf>} heat @param {Record<string, string>} colors
 */
export function drawHeat(context, { width, cell_px, share }, colors) {
  share.forEach((value, cell) => {
    if (value < 0.002) return;
    // The root shows places that were visited seldom, too.
    const strength = Math.sqrt(value);
    context.globalAlpha = 0.15 + 0.75 * strength;
    context.fillStyle = `color-mix(in oklab, ${colors.water}, ${colors.accent} ${Math.round(100 * strength)}%)`;
    context.fillRect((cell % width) * cell_px, Math.floor(cell / width) * cell_px, cell_px, cell_px);
  });
  context.globalAlpha = 1;
}
