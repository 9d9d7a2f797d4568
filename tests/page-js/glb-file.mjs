// A small virtual fish as a GLB file: two joints, two frames, one triangle for the body and one for the fins.

const COMPONENTS = { Uint8Array: 5121, Uint16Array: 5123, Uint32Array: 5125, Float32Array: 5126 };

/** Returns a file; `edit` may change its JSON. @param {(root: any) => void} [edit] @returns {ArrayBuffer} */
export function glbFile(edit = () => {}) {
  const [pieces, accessors, bufferViews] = [[], [], []];
  let length = 0;
  const put = (values, type, width) => {
    const bytes = new Uint8Array(values.buffer);
    bufferViews.push({ buffer: 0, byteOffset: length, byteLength: bytes.length });
    accessors.push({ bufferView: accessors.length, componentType: COMPONENTS[values.constructor.name], count: values.length / width, type });
    const padded = new Uint8Array(Math.ceil(bytes.length / 4) * 4);
    padded.set(bytes);
    pieces.push(padded);
    length += padded.length;
    return accessors.length - 1;
  };
  const floats = (values, type, width) => put(new Float32Array(values), type, width);
  const half = Math.SQRT1_2;
  const attributes = {
    POSITION: floats([0.05, 0, 0, -0.05, 0.01, 0, -0.05, -0.01, 0], "VEC3", 3), NORMAL: floats([0, 0, 1, 0, 0, 1, 0, 0, 1], "VEC3", 3),
    COLOR_0: put(new Uint16Array(12).fill(65535), "VEC4", 4), JOINTS_0: put(new Uint8Array([0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]), "VEC4", 4), WEIGHTS_0: floats([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0], "VEC4", 4),
  };
  const triangle = put(new Uint32Array([0, 1, 2]), "SCALAR", 1);
  const inverse = [[0.02, 0, 0], [-0.01, 0, 0]].flatMap(([x, y, z]) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1]);
  const times = floats([0, 1 / 30], "SCALAR", 1);
  // Frame 0: to the right. Frame 1: up in the picture, hidden, and the second joint bends to +z.
  const outputs = {
    translation: floats([0, 0, -1, 0.1, 0.2, -1], "VEC3", 3), rotation: floats([0, 0, 0, 1, 0, 0, half, half], "VEC4", 4), scale: floats([1, 1, 1, 0, 0, 0], "VEC3", 3),
    first: floats([0, 0, 0, 1, 0, 0, 0, 1], "VEC4", 4), second: floats([0, 0, 0, 1, 0, half, 0, half], "VEC4", 4),
  };
  const channels = [[0, "translation", "translation"], [0, "rotation", "rotation"], [0, "scale", "scale"], [1, "rotation", "first"], [2, "rotation", "second"]];
  const root = {
    asset: { version: "2.0" }, accessors, bufferViews,
    nodes: [{ children: [1] }, { children: [2], translation: [0.02, 0, 0] }, { translation: [-0.03, 0, 0] }],
    meshes: [{ primitives: [{ attributes, indices: triangle }, { attributes, indices: triangle }] }],
    skins: [{ joints: [1, 2], skeleton: 0, inverseBindMatrices: floats(inverse, "MAT4", 16) }],
    animations: [{ channels: channels.map(([node, path], sampler) => ({ sampler, target: { node, path } })), samplers: channels.map(([, , name]) => ({ input: times, output: outputs[name] })) }],
    cameras: [{ perspective: { yfov: Math.PI / 2 } }],
  };
  root.buffers = [{ byteLength: length }];
  edit(root);
  let json = JSON.stringify(root);
  json = json.padEnd(Math.ceil(json.length / 4) * 4);
  const file = new Uint8Array(28 + json.length + length);
  const view = new DataView(file.buffer);
  for (const [at, value] of [[0, 0x46546c67], [4, 2], [8, file.length], [12, json.length], [16, 0x4e4f534a], [20 + json.length, length], [24 + json.length, 0x004e4942]]) view.setUint32(at, value, true);
  file.set(new TextEncoder().encode(json), 20);
  let at = 28 + json.length;
  for (const piece of pieces) { file.set(piece, at); at += piece.length; }
  return file.buffer;
}
