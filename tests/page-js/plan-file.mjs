// Builds flock.plan files for the tests.

const ARRAYS = { u8: Uint8Array, i8: Int8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, i32: Int32Array };

/** Returns columns for individuals that swim to the left, 2 pixels a frame. */
export function swimmers(nIndividuals, nFrames) {
  const cells = Array.from({ length: nIndividuals * nFrames }, (_, k) => [Math.floor(k / nFrames), k % nFrames]);
  const of = (value) => cells.map(([i, t]) => value(i, t));
  return {
    source_frame: ["u16", 1, of((i, t) => 300 + t)], mirrored: ["u8", 1, of((i) => i % 2)],
    x: ["i16", 0.01, of((i, t) => 20000 + 1000 * i - 200 * t)], y: ["i16", 0.01, of((i) => 10000 + 500 * i)],
    rotation: ["i16", 0.00001, of((i) => -1000 * i)], scale: ["u16", 0.0001, of(() => 9500)],
    depth: ["u16", 0.01, of((i) => 100 * i)], state: ["u8", 1, of(() => 2)],
    fade_source_frame: ["u16", 1, [7, 8]], fade_rotation: ["i8", 0.00001, [1, -1]],
    fade_scale: ["u16", 0.0001, [10000, 10000]], fade_weight: ["u16", 0.0001, [2500, 5000]],
  };
}

/** Returns the bytes of a plan. `change` may alter its head before it is written. */
export function planFile({ nIndividuals = 3, nFrames = 12, columns = swimmers(nIndividuals, nFrames), change = () => {} } = {}) {
  const parts = [];
  let at = 0;
  const described = Object.entries(columns).map(([name, [type, scale, values]]) => {
    const bytes = new Uint8Array(ARRAYS[type].from(values).buffer);
    const column = { name, type, scale, n: values.length, at };
    const padded = new Uint8Array(Math.ceil(bytes.length / 4) * 4);
    padded.set(bytes);
    parts.push(padded);
    at += padded.length;
    return column;
  });
  const head = {
    schema: "flockreel/plan@1", version: "0.1.0", params: { frames: nFrames, mirror: true, matching: { rho_deg: 10 } }, seed: 1, fps: 30,
    image_size_px: [640, 480], length_px: 40, stats: {}, n_frames: nFrames, n_individuals: nIndividuals,
    individuals: Array.from({ length: nIndividuals }, (_, id) => ({ id, size: 1 })), predator: [],
    fades: [{ individual: 1, start: 4, n: 2, mirrored: true }], columns: described,
  };
  change(head);
  const text = new TextEncoder().encode(JSON.stringify(head));
  const nHead = Math.ceil(text.length / 4) * 4;
  const file = new Uint8Array(16 + nHead + at).fill(32, 16, 16 + nHead);
  file.set(new TextEncoder().encode("FLOCKPLN"));
  new DataView(file.buffer).setUint32(8, 1, true);
  new DataView(file.buffer).setUint32(12, nHead, true);
  file.set(text, 16);
  let next = 16 + nHead;
  for (const part of parts) {
    file.set(part, next);
    next += part.length;
  }
  return file;
}

/** Returns numbers from 0 to 1 that depend on the seed only. */
export function randomFrom(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
