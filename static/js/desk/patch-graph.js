// Questions to the graph of patches: which one holds a frame, where it can go on, and which are the longest.
// @ts-check

/** @typedef {{start: Int32Array, end: Int32Array}} Patches sorted by their start, without overlap */
/** @typedef {{from: Int32Array, to: Int32Array, mirrored: Uint8Array}} Leaps sorted by `from` */

/** Returns the index of the first value that is not less than `value`. @param {Int32Array} sorted @param {number} value */
export function lowerBound(sorted, value) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Returns the patch that holds a frame, or -1. @param {Patches} patches @param {number} frame */
export function patchAt({ start, end }, frame) {
  const k = lowerBound(start, frame + 1) - 1;
  return k >= 0 && frame < end[k] ? k : -1;
}

/** Returns the jumps that leave a frame. @param {Leaps} leaps @param {number} frame @returns {{from: number, to: number, mirrored: boolean}[]} */
export function leapsFrom({ from, to, mirrored }, frame) {
  const found = [];
  for (let k = lowerBound(from, frame); k < from.length && from[k] === frame; k++) found.push({ from: frame, to: to[k], mirrored: mirrored[k] === 1 });
  return found;
}

/** Returns the longest patches, the longest first. @param {Patches} patches @param {number} most */
export function longestPatches({ start, end }, most) {
  return Array.from(start, (_, k) => k).sort((a, b) => end[b] - start[b] - (end[a] - start[a]) || a - b).slice(0, most);
}
