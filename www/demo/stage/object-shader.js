// The shaders of a thing on the sheet: how it looks, what it hides, and its shadow, on itself and on the sheet.

import { PAPERS_GLSL } from "../graphics/papers.js";
import { PROJECTION_GLSL } from "./projection.js";

/** A point of the thing in the camera's frame, and its normal. */
const PLACED_GLSL = `
layout(location = 0) in vec3 a_position;   // of the thing, y up, on a circle of radius 1
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec4 a_color;      // linear light, and how far it sways
uniform mat3 u_turn;               // from the thing's frame to the camera's
uniform vec3 u_origin;             // mm
uniform float u_scaleMm;
uniform float u_sway;              // radians
mat3 swaying() {
  float angle = u_sway * a_color.a;
  return mat3(1.0, 0.0, 0.0, 0.0, cos(angle), sin(angle), 0.0, -sin(angle), cos(angle));
}
vec3 placed() { return u_turn * (swaying() * a_position) * u_scaleMm + u_origin; }`;

export const OBJECT_VERTEX_SHADER = `#version 300 es
precision highp float;
${PLACED_GLSL}
${PROJECTION_GLSL}
out vec3 v_position;
out vec3 v_normal;
out vec3 v_color;
void main() {
  v_position = placed();
  v_normal = u_turn * (swaying() * a_normal);
  v_color = a_color.rgb;
  gl_Position = projected(v_position);
}`;

export const SHADOW_MAP_VERTEX_SHADER = `#version 300 es
precision highp float;
${PLACED_GLSL}
uniform mat4 u_lightFromCamera;
void main() { gl_Position = u_lightFromCamera * vec4(placed(), 1.0); }`;

export const SHADOW_MAP_FRAGMENT_SHADER = `#version 300 es
precision highp float;
void main() {}`;

/** `lit(p, n)`: how much of the directed light reaches a point with that normal, 0 to 1. */
export const SHADOW_GLSL = `
precision highp sampler2DShadow;
uniform sampler2DShadow u_shadow;
uniform mat4 u_lightFromCamera;
uniform vec3 u_toLight;            // camera frame, of length 1
uniform float u_shadowTexel;       // mm
float lit(vec3 p, vec3 n) {
  // Off the surface, so that it does not shade itself.
  vec3 q = (u_lightFromCamera * vec4(p + (n + 0.5 * u_toLight) * 1.5 * u_shadowTexel, 1.0)).xyz * 0.5 + 0.5;
  if (any(greaterThan(abs(q - 0.5), vec3(0.5)))) return 1.0;
  float sum = 0.0;
  vec2 texel = 1.3 / vec2(textureSize(u_shadow, 0));
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++) sum += texture(u_shadow, q + vec3(vec2(i, j) * texel, 0.0));
  return sum / 9.0;
}`;

export const OBJECT_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform vec3 u_tint;               // of the light
uniform float u_everywhere;
uniform float u_directed;
uniform vec3 u_up;                 // of the sheet where it stands, camera frame
uniform float u_strength;
in vec3 v_position;
in vec3 v_normal;
in vec3 v_color;
out vec4 o_color;                  // premultiplied
${PAPERS_GLSL}
${SHADOW_GLSL}
void main() {
  vec3 toEye = normalize(-v_position);
  vec3 normal = normalize(v_normal);
  if (dot(normal, toEye) < 0.0) normal = -normal;
  float facing = max(dot(normal, u_toLight), 0.0);
  float sky = 0.72 + 0.28 * dot(normal, u_up);
  float gloss = 0.1 * pow(max(dot(normal, normalize(u_toLight + toEye)), 0.0), 40.0);
  float direct = facing > 0.0 ? lit(v_position, normal) * u_directed : 0.0;
  vec3 color = v_color * (u_everywhere * sky + direct * facing) + gloss * direct;
  o_color = vec4(displayFromLinear(color * u_tint), 1.0) * u_strength;
}`;

/** On the sheet: what the shadow of the thing, and its nearness, take from the light. Beside {@link SHADOW_GLSL}. */
export const SHADOW_ON_SHEET_GLSL = `
uniform vec3 u_origin;             // where the thing stands, mm
uniform float u_scaleMm;
uniform float u_shade;             // of the light on the sheet, what is left in the shadow
vec4 shadowOfObject() {
  if (!gl_FrontFacing) return vec4(0.0);
  float near = length(v_position - u_origin) / u_scaleMm;
  float light = mix(u_shade, 1.0, near < 4.0 ? lit(v_position, normalize(v_normal)) : 1.0);
  float edge = max(near - 0.95, 0.0) / 0.22;
  light *= 1.0 - 0.35 * exp(-edge * edge);
  // What multiplies linear light, as the opacity of black over sRGB.
  return vec4(0.0, 0.0, 0.0, 1.0 - pow(light, 1.0 / 2.2)) * smoothstep(0.3, 0.7, v_seen.y);
}`;
