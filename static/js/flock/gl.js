// Draws a flock with WebGL 2: the background, then all individuals as instances of one quad, far to near.
// @ts-check
import { keptColor } from "./appearance.js";
import { KINDS, programs } from "./gl-program.js";

/** @typedef {import("./drawer.js").Scene} Scene @typedef {import("./drawer.js").Layer} Layer @typedef {import("./appearance.js").Shown} Shown */
/** @typedef {ReturnType<typeof import("./gl-program.js").link>} Program @typedef {{background: Program, single: Program, fading: Program}} Programs */

/** Numbers of an instance: see the inputs of the vertex shader. */
const N_FLOATS = 24;

/**
 * Returns a drawer; null if the browser has no WebGL 2.
 * @param {HTMLCanvasElement} canvas @param {Scene} scene @returns {import("./drawer.js").Drawer | null}
 */
export function glDrawer(canvas, scene) {
  const context = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
  if (!context) return null;
  const gl = context;
  let made = build(gl, scene);
  let last = /** @type {Layer[]} */ ([]);
  let instances = new Float32Array(0);

  const onLost = (/** @type {Event} */ event) => event.preventDefault();
  const onRestored = () => {
    made = build(gl, scene);
    draw(last);
  };
  canvas.addEventListener("webglcontextlost", onLost);
  canvas.addEventListener("webglcontextrestored", onRestored);

  /** @param {Layer[]} layers */
  function draw(layers) {
    last = layers;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.disable(gl.BLEND);
    gl.useProgram(made.background.program);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.BLEND);
    for (const { appearances, opacity } of layers) {
      const n = appearances.length;
      if (instances.length < n * N_FLOATS) instances = new Float32Array(n * N_FLOATS);
      for (const [k, one] of appearances.entries()) instances.set(instanceOf(one, scene), k * N_FLOATS);
      gl.bufferData(gl.ARRAY_BUFFER, instances.subarray(0, n * N_FLOATS), gl.STREAM_DRAW);
      for (const kind of [made.single, made.fading]) {
        gl.useProgram(kind.program);
        gl.uniform1f(kind.opacity, opacity);
      }
      for (let from = 0, to = 0; from < n; from = to) {
        const isFading = appearances[from].weight > 0;
        while (to < n && appearances[to].weight > 0 === isFading) to++;
        gl.useProgram((isFading ? made.fading : made.single).program);
        readFrom(gl, from);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, to - from);
      }
    }
  }

  /** Loads only what is another one: the atlas of a library takes longer than a frame. @param {Scene} next */
  function setScene(next) {
    const former = scene;
    scene = next;
    if (former.atlas === next.atlas) return prepare(gl, made, next, former);
    made.free();
    made = build(gl, next);
    return undefined;
  }

  function dispose() {
    canvas.removeEventListener("webglcontextlost", onLost);
    canvas.removeEventListener("webglcontextrestored", onRestored);
    made.free();
    // Browsers limit the number of contexts, and collect them late.
    gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
  return { setScene, draw, dispose };
}

/** @param {import("./appearance.js").Appearance} one @param {Scene} scene */
function instanceOf({ x, y, depth, main, second, weight }, { atlas, haze }) {
  const [a, b] = [main, second ?? main];
  const look = (/** @type {Shown} */ { rotation, scale, mirrored, sprite }) => [rotation, scale / atlas.scale, mirrored ? -1 : 1, sprite.page];
  const box = (/** @type {Shown} */ { sprite }) => [sprite.x, sprite.y, sprite.w, sprite.h];
  const center = (/** @type {Shown} */ { sprite }) => [sprite.cx, sprite.cy];
  return [x, y, weight, keptColor(haze, depth), ...look(a), ...look(b), ...box(a), ...box(b), ...center(a), ...center(b)];
}

/** Binds the inputs of the vertex shader to the instances from one on. @param {WebGL2RenderingContext} gl @param {number} first */
function readFrom(gl, first) {
  for (let slot = 0; slot < N_FLOATS / 4; slot++) gl.vertexAttribPointer(slot, 4, gl.FLOAT, false, 4 * N_FLOATS, 4 * N_FLOATS * first + 16 * slot);
}

/** Fills a new or restored context with everything that stays. @param {WebGL2RenderingContext} gl @param {Scene} scene */
function build(gl, scene) {
  const { background, single, fading } = programs(gl);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (let slot = 0; slot < N_FLOATS / 4; slot++) {
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribDivisor(slot, 1);
  }
  readFrom(gl, 0);
  const plate = texture(gl, gl.TEXTURE0, gl.TEXTURE_2D);
  const { pages } = scene.atlas;
  const sheet = texture(gl, gl.TEXTURE1, gl.TEXTURE_2D_ARRAY);
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA8, Math.max(...pages.map((page) => page.width)), Math.max(...pages.map((page) => page.height)), pages.length);
  for (const [k, page] of pages.entries()) {
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, k, page.width, page.height, 1, gl.RGBA, gl.UNSIGNED_BYTE, page);
  }
  const free = () => {
    for (const { program } of [background, single, fading]) gl.deleteProgram(program);
    for (const one of [plate, sheet]) gl.deleteTexture(one);
    gl.deleteBuffer(buffer);
  };
  const withOpacity = (/** @type {Program} */ kind) => ({ ...kind, opacity: kind.at("opacity") });
  const made = { background, single: withOpacity(single), fading: withOpacity(fading), free };
  prepare(gl, made, scene);
  return made;
}

/** Sets what may differ between two scenes of one atlas. @param {WebGL2RenderingContext} gl @param {Programs} made @param {Scene} scene @param {Scene} [former] */
function prepare(gl, { background, single, fading }, { background: { picture, color }, sizePx, haze }, former) {
  gl.useProgram(background.program);
  gl.uniform1i(background.at("kind"), picture ? KINDS.picture : color ? KINDS.color : KINDS.checkers);
  gl.uniform3fv(background.at("color"), color ?? [0, 0, 0]);
  for (const { program, at } of [single, fading]) {
    gl.useProgram(program);
    gl.uniform1i(at("pages"), 1);
    gl.uniform2f(at("size"), sizePx[0], sizePx[1]);
    gl.uniform3fv(at("haze"), haze.color);
  }
  if (!picture || picture === former?.background.picture) return;
  gl.activeTexture(gl.TEXTURE0);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
}

/** Returns a new, smooth texture, bound to a unit. @param {WebGL2RenderingContext} gl @param {number} unit @param {number} kind */
function texture(gl, unit, kind) {
  gl.activeTexture(unit);
  const made = gl.createTexture();
  gl.bindTexture(kind, made);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, name, gl.LINEAR);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(kind, name, gl.CLAMP_TO_EDGE);
  return made;
}
