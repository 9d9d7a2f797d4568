// The WebGL 2 programs: for the background, for one sprite, and for two sprites that fade. One program for both
// would sample every sprite twice in software renderers, which follow both sides of a branch.
// @ts-check
import { CHECKERS } from "./appearance.js";

export const KINDS = { picture: 0, checkers: 1, color: 2 };

const BACKGROUND = [`#version 300 es
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0, 1);
}`, `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform int kind;
uniform vec3 color;
in vec2 at;
out vec4 shown;
void main() {
  ivec2 square = ivec2(gl_FragCoord.xy) / ${CHECKERS.side};
  vec3 checkers = vec3(((square.x + square.y) & 1) == 0 ? ${CHECKERS.grays[0]} : ${CHECKERS.grays[1]});
  shown = vec4(kind == 0 ? texture(picture, at).rgb : kind == 1 ? checkers : color, 1);
}`];

// A quad covers an individual: the oriented box of its main sprite, or the upright box of both. Both pictures are added before they are laid over the background, as in the film. A look is rotation,
// picture pixels per page pixel, mirror sign, page; a box is x, y, w, h on the page.
const SPRITES = [`#version 300 es
uniform vec2 size;
layout(location = 0) in vec4 place; // x, y, weight, kept color
layout(location = 1) in vec4 look0;
layout(location = 2) in vec4 look1;
layout(location = 3) in vec4 box0;
layout(location = 4) in vec4 box1;
layout(location = 5) in vec4 centers;
out vec2 at0;
out vec2 at1;
flat out vec4 bounds0;
flat out vec4 bounds1;
flat out vec4 mixing;
mat2 turn(vec4 look) {
  float c = cos(look.x) * look.y, s = sin(look.x) * look.y;
  return mat2(look.z * c, look.z * s, -s, c);
}
void main() {
  bounds0 = vec4(box0.xy - 0.5, box0.xy + box0.zw + 0.5); // with half of the transparent border
  bounds1 = vec4(box1.xy - 0.5, box1.xy + box1.zw + 0.5);
  mat2 turn0 = turn(look0), turn1 = turn(look1);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 point = turn0 * (mix(bounds0.xy, bounds0.zw, corner) - centers.xy);
#ifdef FADING
  vec2 low = point, high = point;
  for (int k = 0; k < 4; k++) {
    vec2 other = vec2(k & 1, k >> 1);
    vec2 a = turn0 * (mix(bounds0.xy, bounds0.zw, other) - centers.xy);
    vec2 b = turn1 * (mix(bounds1.xy, bounds1.zw, other) - centers.zw);
    low = min(low, min(a, b));
    high = max(high, max(a, b));
  }
  point = mix(low, high, corner);
#endif
  at0 = inverse(turn0) * point + centers.xy;
  at1 = inverse(turn1) * point + centers.zw;
  mixing = vec4(look0.w, look1.w, place.zw);
  point = 2.0 * (point + place.xy) / size - 1.0;
  gl_Position = vec4(point.x, -point.y, 0, 1);
}`, `#version 300 es
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray pages;
uniform vec3 haze;
uniform float opacity;
in vec2 at0;
in vec2 at1;
flat in vec4 bounds0;
flat in vec4 bounds1;
flat in vec4 mixing;
out vec4 shown;
vec4 pick(vec2 at, float page) {
  return textureLod(pages, vec3(at / vec2(textureSize(pages, 0).xy), page), 0.0);
}
bool isIn(vec2 at, vec4 bounds) {
  return all(greaterThan(at, bounds.xy)) && all(lessThan(at, bounds.zw));
}
void main() {
#ifdef FADING
  vec4 sum = vec4(0);
  if (isIn(at0, bounds0)) sum += (1.0 - mixing.z) * pick(at0, mixing.x);
  if (isIn(at1, bounds1)) sum += mixing.z * pick(at1, mixing.y);
#else
  vec4 sum = pick(at0, mixing.x); // the quad is the box
#endif
  shown = vec4(mix(haze * sum.a, sum.rgb, mixing.w), sum.a) * opacity;
}`];

/** Compiles the programs. @param {WebGL2RenderingContext} gl */
export const programs = (gl) => ({
  background: link(gl, BACKGROUND),
  single: link(gl, SPRITES),
  fading: link(gl, SPRITES.map((text) => text.replace("\n", "\n#define FADING\n"))),
});

/** Compiles one program from the texts of its two shaders. @param {WebGL2RenderingContext} gl @param {string[]} texts */
export function link(gl, texts) {
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  for (const [k, text] of texts.entries()) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(k === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(`WebGL refused a program: ${gl.getProgramInfoLog(program)}`);
  return { program, at: (/** @type {string} */ name) => gl.getUniformLocation(program, name) };
}
