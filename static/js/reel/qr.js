// A link as a QR code (ISO/IEC 18004): bytes, error correction of level L, versions 1 to 13.
// @ts-check
import { svg } from "../app/element.js";

/** By version: bytes of error correction in each block, number of blocks, bytes in all. */
const VERSIONS = [[7, 1, 26], [10, 1, 44], [15, 1, 70], [20, 1, 100], [26, 1, 134], [18, 2, 172], [20, 2, 196], [24, 2, 242], [30, 2, 292], [18, 4, 346], [20, 4, 404], [24, 4, 466], [26, 4, 532]];
/** Width of the light border, modules, and of a module, px: whole numbers keep all modules alike. */
const [BORDER, MODULE_PX] = [4, 4];
/** Whether a mask inverts the module in column x and row y. @type {((x: number, y: number) => boolean)[]} */
const MASKS = [
  (x, y) => (x + y) % 2 === 0, (_, y) => y % 2 === 0, (x) => x % 3 === 0, (x, y) => (x + y) % 3 === 0,
  (x, y) => (Math.floor(x / 3) + Math.floor(y / 2)) % 2 === 0, (x, y) => (x * y) % 6 === 0, (x, y) => ((x * y) % 2 + (x * y) % 3) % 2 === 0, (x, y) => ((x + y) % 2 + (x * y) % 3) % 2 === 0,
];

/** Powers of 2 in the field of 256 elements, twice in a row, and their logarithms. */
const [POWER, LOG] = [new Uint8Array(510), new Uint8Array(256)];
for (let k = 0, value = 1; k < 255; k++) {
  POWER[k] = POWER[k + 255] = value;
  LOG[value] = k;
  value = (value << 1) ^ (value & 128 ? 0x11d : 0);
}
/** @param {number} a @param {number} b */
const times = (a, b) => (a && b ? POWER[LOG[a] + LOG[b]] : 0);

/** Returns the bytes of error correction of a block. @param {number[]} data @param {number} n */
function correctionOf(data, n) {
  let generator = [1];
  for (let k = 0; k < n; k++) generator = [...generator, 0].map((value, i) => value ^ times(generator[i - 1] ?? 0, POWER[k]));
  const rest = [...data, ...Array(n).fill(0)];
  for (let k = 0; k < data.length; k++) {
    const first = rest[k];
    generator.forEach((value, i) => { rest[k + i] ^= times(value, first); });
  }
  return rest.slice(data.length);
}

/** Returns the bytes of a code in their order. @param {Uint8Array} text @param {number} version */
function bytesOf(text, version) {
  const [nCorrection, nBlocks, nAll] = VERSIONS[version - 1];
  const nData = nAll - nCorrection * nBlocks;
  const digits = (/** @type {number} */ value, /** @type {number} */ n) => value.toString(2).padStart(n, "0");
  const bits = `0100${digits(text.length, version < 10 ? 8 : 16)}${[...text].map((value) => digits(value, 8)).join("")}0000`;
  const data = (bits.match(/.{8}/g) ?? []).map((eight) => Number.parseInt(eight, 2));
  for (let k = 0; data.length < nData; k++) data.push(k % 2 ? 17 : 236);
  // The last blocks are one byte longer if the bytes cannot be shared evenly.
  const blocks = Array.from({ length: nBlocks }, (_, k) => {
    const startOf = (/** @type {number} */ at) => Math.floor(nData / nBlocks) * at + Math.max(0, at - nBlocks + (nData % nBlocks));
    return data.slice(startOf(k), startOf(k + 1));
  });
  const woven = (/** @type {number[][]} */ rows) => (rows.at(-1) ?? []).flatMap((_, k) => rows.flatMap((row) => row[k] ?? []));
  return [...woven(blocks), ...woven(blocks.map((block) => correctionOf(block, nCorrection)))];
}

/** Returns a number followed by the rest of its division, n bits long. @param {number} value @param {number} divisor @param {number} n */
function checked(value, divisor, n) {
  let rest = value;
  for (let k = 0; k < n; k++) rest = (rest << 1) ^ ((rest >> (n - 1)) * divisor);
  return (value << n) | rest;
}

/** Returns the modules that are dark whatever the text, as 1, light ones as 0; others are missing. @param {number} version @param {number} mask */
function frameOf(version, mask) {
  const size = 17 + 4 * version;
  /** @type {number[][]} */
  const rows = Array.from({ length: size }, () => Array(size));
  const set = (/** @type {number} */ x, /** @type {number} */ y, /** @type {boolean | number} */ isDark) => { if (x >= 0 && y >= 0 && x < size && y < size) rows[y][x] = Number(isDark); };
  const square = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number[]} */ light, radius = Math.max(...light)) => {
    for (let dy = -radius; dy <= radius; dy++) for (let dx = -radius; dx <= radius; dx++) set(x + dx, y + dy, !light.includes(Math.max(Math.abs(dx), Math.abs(dy))));
  };
  for (let k = 0; k < size; k++) { set(6, k, k % 2 === 0); set(k, 6, k % 2 === 0); }
  const marks = version > 6 ? [6, 2 * version + 8, size - 7] : version > 1 ? [6, size - 7] : [];
  const isCorner = (/** @type {number} */ x, /** @type {number} */ y) => x + y < size && x !== marks[1] * Number(version > 6) && y !== marks[1] * Number(version > 6);
  for (const x of marks) for (const y of marks) if (!isCorner(x, y)) square(x, y, [1], 2);
  for (const [x, y] of [[3, 3], [size - 4, 3], [3, size - 4]]) square(x, y, [2, 4]);
  const format = checked(8 | mask, 0x537, 10) ^ 0x5412;
  for (let k = 0; k < 15; k++) {
    const bit = (format >> k) & 1;
    set(k < 8 ? 8 : k < 9 ? 7 : 14 - k, k < 6 ? k : k < 8 ? k + 1 : 8, bit);
    set(k < 8 ? size - 1 - k : 8, k < 8 ? 8 : size - 15 + k, bit);
  }
  set(8, size - 8, true);
  for (let k = 0, told = checked(version, 0x1f25, 12); version > 6 && k < 18; k++) {
    const [a, b] = [size - 11 + (k % 3), Math.floor(k / 3)];
    set(a, b, (told >> k) & 1);
    set(b, a, (told >> k) & 1);
  }
  return rows;
}

/** Returns how hard a code is to read: long lines, squares, look-alikes of corners, and an uneven share of dark modules. @param {number[][]} rows */
function penaltyOf(rows) {
  const lines = [...rows, ...rows.map((_, x) => rows.map((row) => row[x]))].map((line) => line.join(""));
  const runs = lines.flatMap((line) => line.match(/0{5,}|1{5,}/g) ?? []);
  const corners = lines.flatMap((line) => line.match(/(?=00001011101|10111010000)/g) ?? []);
  const squares = rows.flatMap((row, y) => row.filter((value, x) => [rows[y][x + 1], rows[y + 1]?.[x], rows[y + 1]?.[x + 1]].every((other) => other === value)));
  const share = rows.flat().filter(Boolean).length / rows.length ** 2;
  return runs.reduce((sum, run) => sum + run.length - 2, 0) + 3 * squares.length + 40 * corners.length + 10 * Math.floor(Math.abs(share - 0.5) * 20);
}

/** Returns the rows of a code, 1 for dark; null if the text is too long. @param {string} text */
export function qrOf(text) {
  const bytes = new TextEncoder().encode(text);
  const version = 1 + VERSIONS.findIndex(([nCorrection, nBlocks, nAll], k) => bytes.length + (k < 9 ? 2 : 3) <= nAll - nCorrection * nBlocks);
  if (version < 1) return null;
  const bits = bytesOf(bytes, version).flatMap((value) => Array.from({ length: 8 }, (_, k) => (value >> (7 - k)) & 1));
  const codes = MASKS.map((isInverted, mask) => {
    const rows = frameOf(version, mask);
    let [at, isUpward] = [0, true];
    // Columns go in pairs from the right, up and down in turn, and leave out the one of the dotted line.
    for (let right = rows.length - 1; right > 0; right -= right === 8 ? 3 : 2, isUpward = !isUpward) {
      for (let k = 0; k < 2 * rows.length; k++) {
        const [x, step] = [right - (k % 2), k >> 1];
        const y = isUpward ? rows.length - 1 - step : step;
        if (rows[y][x] === undefined) rows[y][x] = (bits[at++] ?? 0) ^ Number(isInverted(x, y));
      }
    }
    return rows;
  });
  return codes.reduce((best, one) => (penaltyOf(one) < penaltyOf(best) ? one : best));
}

/** Returns the picture of a code. @param {number[][]} rows @param {string} label */
export function qrPicture(rows, label) {
  const side = rows.length + 2 * BORDER;
  const path = rows.map((row, y) => row.map((isDark, x) => (isDark ? `M${x + BORDER} ${y + BORDER}h1v1h-1z` : "")).join("")).join("");
  return svg("svg", { class: "qr", viewBox: `0 0 ${side} ${side}`, width: side * MODULE_PX, role: "img", "aria-label": label }, svg("rect", { width: side, height: side, fill: "#fff" }), svg("path", { d: path, "shape-rendering": "crispEdges" }));
}
