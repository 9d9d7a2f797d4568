// Reads the GLB file of a virtual fish (docs/reference/formats.md, "Virtual fish"): one mesh with a body and fins,
// a spine of joints, and a position, a turn and bends for every frame. Other GLB files are refused.
// @ts-check

const MAGIC = 0x46546c67;
const CHUNK = { json: 0x4e4f534a, bytes: 0x004e4942 };
/** Array types by the glTF code of their component. */
const ARRAYS = /** @type {Record<number, any>} */ ({ 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array });
const WIDTHS = /** @type {Record<string, number>} */ ({ SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 });
/** Most joints that the page draws; a fish has 8. */
export const MOST_JOINTS = 8;

/**
 * @typedef {{position: Float32Array, normal: Float32Array, color: Uint16Array | null, place: Float32Array | null, joints: Uint8Array, weights: Float32Array}} Vertices
 *   in metres, y up; colors are linear, 65535 = 1; place: in the picture, null = colors
 * @typedef {{vertices: Vertices, picture: Blob | null, body: Uint32Array, fins: Uint32Array, offsets: number[][], inverse: Float32Array,
 *   nFrames: number, places: Float32Array, turns: Float32Array, bends: Float32Array[], shown: Float32Array | null,
 *   yfov: number | null}} VirtualFish
 *   offsets: each joint from the one before it; shown: 1 or 0 in x of each frame, null = always;
 *   yfov: of the camera that filmed it, radians, null if glTF cannot tell it
 */

export class NotAFish extends Error {}

/** @param {ArrayBuffer} file @returns {VirtualFish} */
export function readGlb(file) {
  try {
    return fishOf(chunksOf(file));
  } catch (reason) {
    throw new NotAFish(String(/** @type {any} */ (reason).message));
  }
}

/** @param {ArrayBuffer} file */
function chunksOf(file) {
  const view = new DataView(file);
  if (view.getUint32(0, true) !== MAGIC || view.getUint32(4, true) !== 2) throw new Error("no GLB of version 2");
  /** @type {any} */
  let root = null;
  let bytes = file.slice(0, 0);
  for (let at = 12; at + 8 <= file.byteLength;) {
    const [length, kind] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    const content = file.slice(at + 8, at + 8 + length);
    if (kind === CHUNK.json) root = JSON.parse(new TextDecoder().decode(content));
    if (kind === CHUNK.bytes) bytes = content;
    at += 8 + length;
  }
  return { root, bytes };
}

/** @param {{root: any, bytes: ArrayBuffer}} chunks @returns {VirtualFish} */
function fishOf({ root, bytes }) {
  const read = (/** @type {number} */ idx) => {
    const { bufferView, byteOffset = 0, componentType, count, type } = root.accessors[idx];
    const start = (root.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
    return new ARRAYS[componentType](bytes, start, count * WIDTHS[type]);
  };
  // An animal seen from above is flat: it has no body but its sheet.
  const surfaces = root.meshes[0].primitives;
  const [body, fins] = surfaces.length > 1 ? surfaces : [null, surfaces[0]];
  const of = fins.attributes;
  const colors = (/** @type {string} */ name) => (of[name] === undefined ? null : read(of[name]));
  const image = root.images?.[0];
  const vertices = { position: read(of.POSITION), normal: read(of.NORMAL), color: colors("COLOR_0"), place: colors("TEXCOORD_0"), joints: read(of.JOINTS_0), weights: read(of.WEIGHTS_0) };
  const { joints, inverseBindMatrices, skeleton } = root.skins[0];
  if (joints.length > MOST_JOINTS) throw new Error(`${joints.length} joints`);
  const [{ channels, samplers }] = root.animations;
  const keys = (/** @type {number} */ node, /** @type {string} */ path) => {
    const found = channels.find((/** @type {any} */ { target }) => target.node === node && target.path === path);
    return found ? read(samplers[found.sampler].output) : null;
  };
  const nFrames = root.accessors[samplers[0].input].count;
  const bends = joints.map((/** @type {number} */ joint) => keys(joint, "rotation"));
  const lens = root.cameras?.[0]?.perspective;
  return {
    vertices, picture: image ? pictureOf(image, root.bufferViews, bytes) : null, body: body ? read(body.indices) : new Uint32Array(0), fins: read(fins.indices), inverse: read(inverseBindMatrices), nFrames, bends,
    offsets: joints.map((/** @type {number} */ joint) => root.nodes[joint].translation ?? [0, 0, 0]),
    places: known(keys(skeleton, "translation"), 3 * nFrames), turns: known(keys(skeleton, "rotation"), 4 * nFrames),
    shown: keys(skeleton, "scale"), yfov: lens?.yfov ?? null,
  };
}

/** @param {{bufferView: number, mimeType: string}} image @param {any[]} views @param {ArrayBuffer} bytes */
function pictureOf({ bufferView, mimeType }, views, bytes) {
  const { byteOffset = 0, byteLength } = views[bufferView];
  return new Blob([bytes.slice(byteOffset, byteOffset + byteLength)], { type: mimeType });
}

/** @template {ArrayLike<any>} T @param {T | null} values @param {number} length @returns {T} */
function known(values, length) {
  if (values?.length !== length) throw new Error("no motion for every frame");
  return values;
}

/** Returns the length of the fish from nose to tail, metres. @param {VirtualFish} fish */
export function lengthOf({ vertices: { position } }) {
  let [least, most] = [Infinity, -Infinity];
  for (let k = 0; k < position.length; k += 3) [least, most] = [Math.min(least, position[k]), Math.max(most, position[k])];
  return most - least;
}
