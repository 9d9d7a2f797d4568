// The WebGL 2 programs of the virtual fish: its lit surface, the same as a wireframe, and lines in space.
// @ts-check
import { link } from "../flock/gl-program.js";

// A lens divides x and y by the apparent depth, which refraction behind the pane makes smaller than the true one.
const LENS = `
uniform mat4 view;
uniform vec4 across, depths; // see lens.js
vec4 seen(vec3 place) {
  vec3 before = (view * vec4(place, 1)).xyz;
  float depth = depths.x + (-before.z - depths.x) / depths.y;
  float near = depths.z, far = depths.w;
  return vec4(across.xy * before.xy + across.zw * depth, ((far + near) * depth - 2.0 * far * near) / (far - near), depth);
}`;

const SURFACE_VERTEX = `#version 300 es
${LENS}
uniform mat4 skin[8];
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in uvec4 joints;
layout(location = 4) in vec4 weights;
layout(location = 5) in vec2 spot;
out vec3 rest, place, facing;
out vec4 tint;
out vec2 at;
void main() {
  mat4 bent = skin[joints.x] * weights.x + skin[joints.y] * weights.y;
  rest = position;
  at = spot;
  place = (bent * vec4(position, 1)).xyz;
  facing = mat3(bent) * normal;
  tint = vec4(pow(color.rgb, vec3(1.0 / 2.2)), color.a);
  gl_Position = seen(place);
}`;

// The light of the fish in the film (crates/flockreel-core/src/fish/light.rs), with y up.
const LIT = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform bool isFin, isPicture;
uniform sampler2D picture;
in vec3 rest, place, facing;
in vec4 tint;
in vec2 at;
out vec4 shown;
const vec3 KEY = vec3(-0.34, 0.80, 0.495);
void main() {
  if (isPicture) { // It was taken in the light of the film.
    vec4 texel = texture(picture, at);
    shown = vec4(texel.rgb, 1) * (isFin ? texel.a : 1.0);
    return;
  }
  vec3 toEye = normalize(eye - place), n = normalize(facing);
  if (isFin && dot(n, toEye) < 0.0) n = -n;
  float wrapped = max((dot(n, KEY) + 0.35) / 1.35, 0.0);
  float light = isFin ? 0.72 + 0.30 * max(wrapped, 0.55) : 0.54 + 0.16 * (0.5 + 0.5 * n.y) + 0.40 * wrapped;
  vec3 lit = tint.rgb * light;
  if (!isFin) {
    float glint = max(dot(n, normalize(KEY + toEye)), 0.0);
    lit += 0.35 * (0.5 * pow(glint, 32.0) + 0.1 * pow(glint, 4.0)) * (0.55 + 0.45 * tint.rgb);
    lit = mix(lit, vec3(0.55, 0.78, 0.84), 0.08 * pow(1.0 - clamp(dot(n, toEye), 0.0, 1.0), 4.0));
  }
  shown = vec4(min(lit, 1.0), 1) * (isFin ? tint.a : 1.0);
}`;

// Rings along the body and lines from head to tail; a grid on the fins; and the outline. Each line is two pixels
// wide, on a dark one that sets it off a bright film.
const WIREFRAME = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform bool isFin, isPicture;
uniform sampler2D picture;
uniform float ring, slice; // distance of two lines: along the body in metres, around it in radians
in vec3 rest, place, facing;
in vec4 tint;
in vec2 at;
out vec4 shown;
float near(float value) {
  float step = fwidth(value);
  return step > 0.4 ? 9.0 : abs(fract(value - 0.5) - 0.5) / step;
}
void main() {
  float side = abs(dot(normalize(facing), normalize(eye - place)));
  float around = isFin ? rest.y / ring : atan(rest.y, rest.z) / slice;
  float pixels = min(near(rest.x / ring), near(around));
  if (!isFin) pixels = min(pixels, side / fwidth(side) * 0.7);
  float line = 1.0 - smoothstep(0.5, 1.2, pixels), halo = 1.0 - smoothstep(1.0, 2.6, pixels);
  float strength = isFin ? 0.7 : 1.0;
  if (isFin && isPicture) strength *= smoothstep(0.2, 0.6, texture(picture, at).a);
  vec4 dark = vec4(0.02, 0.07, 0.09, 1) * (0.12 + 0.5 * halo) * strength;
  shown = mix(dark, vec4(0.55, 0.96, 1.0, 1), line * strength);
}`;

const LINES = [`#version 300 es
${LENS}
layout(location = 0) in vec3 position;
void main() { gl_Position = seen(position); }`, `#version 300 es
precision highp float;
uniform vec4 color;
out vec4 shown;
void main() { shown = vec4(color.rgb, 1) * color.a; }`];

/** Compiles the programs. @param {WebGL2RenderingContext} gl */
export const programs = (gl) => ({ lit: link(gl, [SURFACE_VERTEX, LIT]), wireframe: link(gl, [SURFACE_VERTEX, WIREFRAME]), lines: link(gl, LINES) });
