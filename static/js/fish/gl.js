// Draws the virtual fish with WebGL 2, without a library: its file has one skinned mesh with vertex colors or one
// picture, so that a general reader is not needed.
// @ts-check
import { programs } from "./gl-program.js";

/**
 * @typedef {{points: Float32Array, color: number[]}} Lines in space; color with opacity
 * @typedef {{posture: import("./posture.js").Posture, view: number[], eye: number[], lens: import("./lens.js").Lens, isWireframe?: boolean,
 *   ring?: number, slice?: number, box: number[], lines?: Lines[]}} Scene box: left, bottom, width and height on the canvas; ring
 *   and slice: distance of two lines of the wireframe, along the body in metres and around it in radians
 */

/**
 * Returns a drawer; null if the browser has no WebGL 2.
 * @param {HTMLCanvasElement} canvas @param {import("./glb.js").VirtualFish} fish
 */
export function fishDrawer(canvas, fish) {
  const context = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
  if (!context) return null;
  const gl = context;
  let made = build(gl, fish, again);
  /** @type {Scene | null} */
  let last = null;
  const onLost = (/** @type {Event} */ event) => event.preventDefault();
  const onRestored = () => { made = build(gl, fish, again); again(); };
  function again() { if (last) draw(last); }
  canvas.addEventListener("webglcontextlost", onLost);
  canvas.addEventListener("webglcontextrestored", onRestored);

  /** @param {Scene} scene */
  function draw(scene) {
    last = scene;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.viewport(scene.box[0], scene.box[1], scene.box[2], scene.box[3]);
    for (const lines of scene.lines ?? []) drawLines(lines, scene);
    if (!scene.posture.isShown) return;
    const kind = scene.isWireframe ? made.wireframe : made.lit;
    use(kind, scene);
    gl.uniformMatrix4fv(kind.at("skin"), false, scene.posture.skin);
    gl.uniform3fv(kind.at("eye"), scene.eye);
    gl.uniform1f(kind.at("ring"), scene.ring ?? 1);
    gl.uniform1f(kind.at("slice"), scene.slice ?? 1);
    gl.uniform1i(kind.at("isPicture"), fish.picture ? 1 : 0);
    gl.bindTexture(gl.TEXTURE_2D, made.picture);
    gl.bindVertexArray(made.mesh);
    for (const isFin of [false, true]) {
      gl.uniform1i(kind.at("isFin"), isFin ? 1 : 0);
      // Fins are seen through, so they hide nothing.
      gl.depthMask(!isFin);
      gl.drawElements(gl.TRIANGLES, isFin ? fish.fins.length : fish.body.length, gl.UNSIGNED_INT, isFin ? 4 * fish.body.length : 0);
    }
  }

  /** @param {Lines} lines @param {Scene} scene */
  function drawLines({ points, color }, scene) {
    use(made.lines, scene);
    gl.uniform4fv(made.lines.at("color"), color);
    gl.bindVertexArray(made.drawn);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.points);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STREAM_DRAW);
    gl.drawArrays(gl.LINES, 0, points.length / 3);
  }

  /** @param {{program: WebGLProgram, at: (name: string) => WebGLUniformLocation | null}} kind @param {Scene} scene */
  function use({ program, at }, { view, lens }) {
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("view"), false, view);
    gl.uniform4fv(at("across"), lens.across);
    gl.uniform4fv(at("depths"), lens.depths);
  }

  function dispose() {
    canvas.removeEventListener("webglcontextlost", onLost);
    canvas.removeEventListener("webglcontextrestored", onRestored);
    // Browsers limit the number of contexts, and collect them late.
    gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
  return { draw, dispose };
}

/** Fills a new or restored context. @param {WebGL2RenderingContext} gl @param {import("./glb.js").VirtualFish} fish @param {() => void} onPicture */
function build(gl, { vertices, picture, body, fins }, onPicture) {
  const kinds = programs(gl);
  const mesh = gl.createVertexArray();
  gl.bindVertexArray(mesh);
  const put = (/** @type {number} */ slot, /** @type {ArrayBufferView} */ values) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(slot);
  };
  put(0, vertices.position);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  put(1, vertices.normal);
  gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
  if (vertices.color) {
    put(2, vertices.color);
    gl.vertexAttribPointer(2, 4, gl.UNSIGNED_SHORT, true, 0, 0);
  }
  put(3, vertices.joints);
  gl.vertexAttribIPointer(3, 4, gl.UNSIGNED_BYTE, 0, 0);
  put(4, vertices.weights);
  gl.vertexAttribPointer(4, 4, gl.FLOAT, false, 0, 0);
  if (vertices.place) {
    put(5, vertices.place);
    gl.vertexAttribPointer(5, 2, gl.FLOAT, false, 0, 0);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  const triangles = new Uint32Array(body.length + fins.length);
  triangles.set(body);
  triangles.set(fins, body.length);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);

  const drawn = gl.createVertexArray();
  gl.bindVertexArray(drawn);
  const points = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, points);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  return { ...kinds, mesh, drawn, points, picture: picture && textureOf(gl, picture, onPicture) };
}

/** Returns a texture that is transparent until its picture is read. @param {WebGL2RenderingContext} gl @param {Blob} picture @param {() => void} onPicture */
function textureOf(gl, picture, onPicture) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  createImageBitmap(picture, { premultiplyAlpha: "none" }).then((bitmap) => {
    if (gl.isContextLost()) return;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    onPicture();
  }, () => {});
  return texture;
}
