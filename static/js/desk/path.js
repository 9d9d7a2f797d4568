// The path of the animal over the background, colored from early to late. A click goes to the nearest moment of
// the path.
// @ts-check

/** Most points of the path that are drawn, and number of colors. */
const MOST = 6000;
const STEPS = 48;

/**
 * Draws the path. @param {CanvasRenderingContext2D} context scaled to pixels of the film
 * @param {import("./columns.js").Columns} columns @param {{zoom: number, colors: Record<string, string>}} look
 */
export function drawPath(context, { n, centroid_px: at }, { zoom, colors }) {
  const step = Math.max(1, Math.floor(n / MOST));
  context.lineWidth = 1.8 / zoom;
  context.lineJoin = context.lineCap = "round";
  for (let part = 0; part < STEPS; part++) {
    const [from, to] = [Math.floor((part * n) / STEPS), Math.floor(((part + 1) * n) / STEPS)];
    context.beginPath();
    let isDown = false;
    for (let k = from; k <= Math.min(n - 1, to + step - 1); k += step) {
      if (Number.isNaN(at[2 * k])) { isDown = false; continue; }
      if (isDown) context.lineTo(at[2 * k], at[2 * k + 1]);
      else context.moveTo(at[2 * k], at[2 * k + 1]);
      isDown = true;
    }
    context.strokeStyle = `color-mix(in oklab, ${colors.water}, ${colors.accent} ${Math.round((100 * part) / (STEPS - 1))}%)`;
    context.globalAlpha = n > 20000 ? 0.5 : 0.85;
    context.stroke();
  }
  context.globalAlpha = 1;
}

/**
 * Returns the frame whose centroid is nearest to a point. Among frames about as near, the one nearest in time to
 * `now` wins, so that repeated clicks on a resting animal do not jump about.
 * @param {import("./columns.js").Columns} columns @param {number[]} point pixels of the film @param {number} now frame
 */
export function nearestFrame({ n, centroid_px: at }, [x, y], now) {
  let [best, least] = [now, Infinity];
  for (let k = 0; k < n; k++) {
    const far = Math.hypot(at[2 * k] - x, at[2 * k + 1] - y) + Math.abs(k - now) / (4 * n);
    if (far < least) [best, least] = [k, far];
  }
  return best;
}
