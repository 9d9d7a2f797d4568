// Lines of a plot: thinned to the width of the screen, and broken where nothing was measured and where a heading
// crosses from 180 to -180 degrees. Both ways of drawing take their lines from here, so that none is drawn that
// is not in the data.
// @ts-check

/** @typedef {{x: Float64Array, y: Float32Array, n: number}} Line y NaN breaks the line */

/**
 * Returns a line through the values of frames `from` to `to` (exclusive). With more frames than `most` points it
 * keeps the first, least, greatest and last value of each step, in their order.
 * @param {Float64Array} times @param {Float32Array} values @param {{from: number, to: number, most: number,
 *   turn?: number}} range turn: the full turn of a heading, 360
 * @returns {Line}
 */
export function thinned(times, values, { from, to, most, turn = 0 }) {
  const step = Math.max(1, Math.ceil((4 * (to - from)) / most));
  const room = 4 * (to - from) + 4;
  const line = { x: new Float64Array(step > 1 ? Math.min(room, 6 * most + 64) : room), y: new Float32Array(step > 1 ? Math.min(room, 6 * most + 64) : room), n: 0 };
  const push = (/** @type {number} */ x, /** @type {number} */ y) => {
    if (line.n === line.x.length) grow(line);
    line.x[line.n] = x;
    line.y[line.n] = y;
    line.n += 1;
  };
  let last = NaN;
  let lastTime = 0;
  /** Run of unbroken values of one step: indices of the least and the greatest. */
  let [first, least, greatest] = [-1, -1, -1];
  const flush = (/** @type {number} */ end) => {
    if (first < 0) return;
    const kept = [...new Set([first, least, greatest, end])].sort((a, b) => a - b);
    for (const k of kept) push(times[k], values[k]);
    first = -1;
  };
  for (let k = from; k < to; k++) {
    const value = values[k];
    const isBroken = Number.isNaN(value) || Number.isNaN(last);
    const isCut = !isBroken && turn > 0 && Math.abs(value - last) > turn / 2;
    if (isBroken || isCut) {
      flush(k - 1);
      if (isCut) cut(push, { last, lastTime, value, time: times[k], turn });
      else if (line.n && !Number.isNaN(line.y[line.n - 1])) push(times[k], NaN);
    }
    last = value;
    lastTime = times[k];
    if (Number.isNaN(value)) continue;
    if (first < 0) first = least = greatest = k;
    else if (value < values[least]) least = k;
    else if (value > values[greatest]) greatest = k;
    if ((k - from + 1) % step === 0) flush(k);
  }
  flush(to - 1);
  return line;
}

/**
 * Ends a line at the border that the heading crosses, and begins it again at the other one.
 * @param {(x: number, y: number) => void} push
 * @param {{last: number, lastTime: number, value: number, time: number, turn: number}} step
 */
function cut(push, { last, lastTime, value, time, turn }) {
  const side = last > 0 ? turn / 2 : -turn / 2;
  const share = (side - last) / (value + 2 * side - last || 1);
  const at = lastTime + share * (time - lastTime);
  push(at, side);
  push(at, NaN);
  push(at, -side);
}

/** Doubles the room of a line. @param {Line} line */
function grow(line) {
  const [x, y] = [new Float64Array(2 * line.n), new Float32Array(2 * line.n)];
  x.set(line.x);
  y.set(line.y);
  Object.assign(line, { x, y });
}

/**
 * Draws a line as moves and lines. A single point becomes a short dash.
 * @param {Line} line @param {{moveTo: (x: number, y: number) => void, lineTo: (x: number, y: number) => void}} pen
 * @param {(x: number) => number} xOf @param {(y: number) => number} yOf
 */
export function trace({ x, y, n }, pen, xOf, yOf) {
  for (let k = 0; k < n; k++) {
    if (Number.isNaN(y[k])) continue;
    const isStart = k === 0 || Number.isNaN(y[k - 1]);
    if (isStart) pen.moveTo(xOf(x[k]), yOf(y[k]));
    if (!isStart) pen.lineTo(xOf(x[k]), yOf(y[k]));
    else if (k + 1 === n || Number.isNaN(y[k + 1])) pen.lineTo(xOf(x[k]) + 1, yOf(y[k]));
  }
}

/** Returns a pen that writes the path of an SVG. */
export function svgPen() {
  /** @type {string[]} */
  const parts = [];
  const put = (/** @type {string} */ letter) => (/** @type {number} */ x, /** @type {number} */ y) => { parts.push(`${letter}${x.toFixed(1)} ${y.toFixed(1)}`); };
  return { moveTo: put("M"), lineTo: put("L"), path: () => parts.join("") };
}
