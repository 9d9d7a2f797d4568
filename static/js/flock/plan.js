// Decodes flock.plan: the sprite and place of every individual in every frame (docs/reference/formats.md).
// The file is foreign: every count and offset is checked against the buffer before use.
// @ts-check

const ARRAYS = { u8: Uint8Array, i8: Int8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, i32: Int32Array };
const OF_CELLS = ["source_frame", "mirrored", "x", "y", "rotation", "scale", "depth", "state"];
const OF_FADES = ["fade_source_frame", "fade_rotation", "fade_scale", "fade_weight"];
/** Bytes before the head. */
const LEAD = 16;
/** Largest side of a canvas in all browsers, pixels. */
const MOST_PX = 16384;

/**
 * @typedef {{sourceFrame: number, mirrored: boolean, rotation: number, scale: number}} Look one sprite:
 *   rotation in radians, clockwise after mirroring; scale relative to the film
 * @typedef {Look & {x: number, y: number, depth: number, state: number}} Cell x, y, depth in pixels of the
 *   picture; state 0 rest, 1 slow, 2 go, 3 dart
 * @typedef {Look & {weight: number}} Fade the second sprite around a jump and its share, 0 to 1
 * @typedef {Record<string, {stored: ArrayLike<number>, scale: number}>} Columns by name
 * @typedef {{head: Api.PlanHead, nFrames: number, nIndividuals: number, fps: number, sizePx: number[], lengthPx: number,
 *   cell: (i: number, t: number) => Cell, fadeAt: (i: number, t: number) => Fade | null,
 *   isFirst?: boolean, isPart?: boolean}} Plan isFirst: only the beginning is planned so far; isPart: the rest is never planned
 */

/** Values are scaled when they are read. @param {ArrayBuffer} buffer @returns {Plan} */
export function decodePlan(buffer) {
  const { head, start } = readHead(buffer);
  const nFrames = whole(head.n_frames, "n_frames", 1);
  const nIndividuals = whole(head.n_individuals, "n_individuals", 1);
  const sizePx = list(head.image_size_px, "image_size_px", 2).map((side) => whole(side, "image_size_px", 1, MOST_PX));
  const predator = list(head.predator, "predator");
  need(!predator.length || predator.length === nFrames, "the predator needs a position in every frame");
  for (const point of predator) need(list(point, "predator", 3).every(Number.isFinite), "the predator needs numbers");
  list(head.individuals, "individuals", nIndividuals);

  const columns = readColumns(buffer, start, head);
  const nCells = nFrames * nIndividuals;
  for (const name of OF_CELLS) need(columns[name]?.stored.length === nCells, `column ${name} must have ${nCells} values`);
  const fades = placeFades(list(head.fades, "fades"), columns, nFrames, nIndividuals);
  const value = (/** @type {string} */ name, /** @type {number} */ k) => columns[name].stored[k] * columns[name].scale;
  const look = (/** @type {"" | "fade_"} */ of, /** @type {number} */ k) => ({ sourceFrame: value(`${of}source_frame`, k), rotation: value(`${of}rotation`, k), scale: value(`${of}scale`, k) });
  return {
    head, nFrames, nIndividuals, sizePx, fps: positive(head.fps, "fps", 1000), lengthPx: positive(head.length_px, "length_px", MOST_PX),
    cell(i, t) {
      const k = i * nFrames + t;
      return { ...look("", k), mirrored: value("mirrored", k) > 0, x: value("x", k), y: value("y", k), depth: value("depth", k), state: value("state", k) };
    },
    fadeAt(i, t) {
      const place = fades[i * nFrames + t];
      const k = Math.abs(place) - 1;
      return place ? { ...look("fade_", k), mirrored: place < 0, weight: value("fade_weight", k) } : null;
    },
  };
}

/** @param {ArrayBuffer} buffer */
function readHead(buffer) {
  need(buffer.byteLength >= LEAD, "the file is truncated");
  const view = new DataView(buffer);
  need(String.fromCharCode(...new Uint8Array(buffer, 0, 8)) === "FLOCKPLN", "it does not begin with FLOCKPLN");
  need(view.getUint32(8, true) === 1, "its version is not 1");
  const nBytes = view.getUint32(12, true);
  need(nBytes % 4 === 0 && nBytes <= buffer.byteLength - LEAD, "the file is truncated in its head");
  let head = null;
  try {
    head = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(new Uint8Array(buffer, LEAD, nBytes)));
  } catch {
    need(false, "its head is not JSON");
  }
  need(head?.schema === "flockreel/plan@1", "its schema is not flockreel/plan@1");
  return { head, start: LEAD + nBytes };
}

/**
 * Returns the columns by name, as views of the buffer.
 * @param {ArrayBuffer} buffer @param {number} start @param {Api.PlanHead} head @returns {Columns}
 */
function readColumns(buffer, start, head) {
  /** @type {Columns} */
  const columns = Object.create(null);
  for (const column of list(head.columns, "columns")) {
    const { name, type, scale, n, at } = column ?? {};
    need(typeof name === "string" && !columns[name] && Object.hasOwn(ARRAYS, type), "a column has an unknown type or comes twice");
    const kind = ARRAYS[/** @type {keyof typeof ARRAYS} */ (type)];
    whole(n, `n of ${name}`, 0);
    whole(at, `at of ${name}`, 0);
    need(at % 4 === 0 && at + n * kind.BYTES_PER_ELEMENT <= buffer.byteLength - start, `the file is truncated in column ${name}`);
    columns[name] = { stored: new kind(buffer, start + at, n), scale: positive(scale, `scale of ${name}`, 1e9) };
  }
  return columns;
}

/**
 * Returns for every cell its place in the columns of fades, plus 1; negative if mirrored, 0 without a fade.
 * @param {Api.PlanHead["fades"]} fades @param {Columns} columns @param {number} nFrames @param {number} nIndividuals
 */
function placeFades(fades, columns, nFrames, nIndividuals) {
  const total = columns[OF_FADES[0]]?.stored.length;
  for (const name of OF_FADES) need(columns[name]?.stored.length === total, `column ${name} is missing or too short`);
  const places = new Int32Array(nFrames * nIndividuals);
  let k = 0;
  for (const fade of fades) {
    const first = whole(fade?.individual, "individual of a fade", 0, nIndividuals - 1) * nFrames;
    const start = whole(fade.start, "start of a fade", 0, nFrames - 1);
    const n = whole(fade.n, "n of a fade", 1, Math.min(nFrames - start, total - k));
    for (let t = start; t < start + n; t++) places[first + t] = fade.mirrored ? -++k : ++k;
  }
  need(k === total, `the fades have ${k} of ${total} frames`);
  return places;
}

/** @param {boolean} isTrue @param {string} sentence @returns {asserts isTrue} */
function need(isTrue, sentence) {
  if (!isTrue) throw new Error(`This plan cannot be read: ${sentence}.`);
}

/** @param {number} value @param {string} name @param {number} least */
function whole(value, name, least, most = Number.MAX_SAFE_INTEGER) {
  need(Number.isSafeInteger(value) && value >= least && value <= most, `${name} must be a whole number from ${least} to ${most}`);
  return value;
}

/** @param {number} value @param {string} name @param {number} most */
function positive(value, name, most) {
  need(Number.isFinite(value) && value > 0 && value <= most, `${name} must be a number above 0`);
  return value;
}

/** @template T @param {T[]} value @param {string} name */
function list(value, name, n = value?.length) {
  need(Array.isArray(value) && value.length === n, `${name} must be a list of ${n}`);
  return value;
}
