// Reads tracks.csv while it loads: place, box and visibility of every individual in every frame
// (docs/reference/formats.md, "Ground truth"). Arrays of numbers take a tenth of the memory of objects.
// @ts-check

/** Columns that are kept. */
const KEPT = ["id", "x_px", "y_px", "scale", "visible_x_px", "visible_y_px", "visible_w_px", "visible_h_px", "amodal_x_px", "amodal_y_px", "amodal_w_px", "amodal_h_px", "visibility"];

/**
 * @typedef {{id: number, x: number, y: number, scale: number, visible: number[] | null, amodal: number[] | null, visibility: number}} Track
 *   one individual in one frame, pixels of the video; a box is [x, y, width, height], null where there is none
 * @typedef {{nFrames: number, at: (frame: number) => Track[]}} Tracks
 */

/** Collects rows, given line by line. */
export function createTracks() {
  /** @type {number[]} */
  let places = [];
  let frameColumn = 0;
  let values = new Float32Array(KEPT.length * 1024);
  let n_rows = 0;
  /** First row of each frame. @type {number[]} */
  const first = [];

  /** @param {string} line */
  function add(line) {
    if (!line) return;
    const cells = line.split(",");
    if (!places.length) {
      places = KEPT.map((name) => cells.indexOf(name));
      frameColumn = cells.indexOf("frame");
      if (frameColumn < 0 || places.includes(-1)) throw new Error("tracks.csv cannot be read: a column is missing.");
      return;
    }
    const frame = Number(cells[frameColumn]);
    if (!(Number.isSafeInteger(frame) && frame >= 0)) throw new Error(`tracks.csv cannot be read: frame ${cells[frameColumn]}.`);
    // Rows are sorted by frame.
    while (first.length <= frame) first.push(n_rows);
    if (values.length < (n_rows + 1) * KEPT.length) {
      const longer = new Float32Array(values.length * 2);
      longer.set(values);
      values = longer;
    }
    for (const [k, place] of places.entries()) values[n_rows * KEPT.length + k] = cells[place] === "" ? NaN : Number(cells[place]);
    n_rows += 1;
  }

  /** @param {number} k @param {string} name */
  const value = (k, name) => values[k * KEPT.length + KEPT.indexOf(name)];
  /** @param {number} k @param {string} kind */
  function box(k, kind) {
    const sides = ["x", "y", "w", "h"].map((side) => value(k, `${kind}_${side}_px`));
    return sides.every(Number.isFinite) && sides[2] > 0 && sides[3] > 0 ? sides : null;
  }
  return {
    add,
    /** Frames that are read. */
    get nFrames() { return first.length; },
    /** Returns the individuals of a frame; none if it is not read. @param {number} frame @returns {Track[]} */
    at(frame) {
      const rows = [];
      for (let k = first[frame] ?? n_rows; k < (first[frame + 1] ?? n_rows); k++) {
        rows.push({ id: value(k, "id"), x: value(k, "x_px"), y: value(k, "y_px"), scale: value(k, "scale"), visible: box(k, "visible"), amodal: box(k, "amodal"), visibility: value(k, "visibility") });
      }
      return rows;
    },
  };
}

/**
 * Loads tracks.csv. It can be read from while it loads. @param {Response} response @param {() => void} onPart
 * @param {ReturnType<typeof createTracks>} [tracks]
 */
export async function readTracks(response, onPart = () => {}, tracks = createTracks()) {
  const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader();
  const decoder = new TextDecoder();
  let rest = "";
  for (;;) {
    const { done, value } = await reader.read();
    const lines = (rest + (value ? decoder.decode(value, { stream: true }) : "")).split("\n");
    rest = done ? "" : lines.pop() ?? "";
    for (const line of lines) tracks.add(line);
    onPart();
    if (done) return tracks;
  }
}
