// Headings that a film lacks: runs of empty bins of its histogram.
// @ts-check

/** Empty bins next to each other that count as a gap: 30 degrees. */
const LEAST_GAP = 3;

/**
 * Returns the runs of empty bins as [first, length], across the border from 180 to -180 degrees.
 * @param {number[]} bins @returns {[number, number][]}
 */
export function gapsOf(bins) {
  const n = bins.length;
  const start = bins.findIndex((one) => one > 0);
  if (start < 0) return n ? [[0, n]] : [];
  /** @type {[number, number][]} */
  const gaps = [];
  let length = 0;
  for (let k = 1; k <= n; k++) {
    if (bins[(start + k) % n] === 0) { length += 1; continue; }
    if (length >= LEAST_GAP) gaps.push([(start + k - length) % n, length]);
    length = 0;
  }
  return gaps;
}
