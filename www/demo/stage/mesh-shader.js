// The mesh's shaders: its projection, the overlays that are drawn from it, and the light on it.

import { PAPERS_GLSL, paperGlsl } from "../graphics/papers.js";
import { SHADOW_GLSL, SHADOW_ON_SHEET_GLSL } from "./object-shader.js";
import { PROJECTION_GLSL } from "./projection.js";

/** @import { PaperSource } from "../graphics/papers.js" */

/** @typedef {"paper" | "object" | "depth" | "mesh" | "shaded"} MeshOverlay */

/** @type {Readonly<Record<MeshOverlay, string>>} */
export const MESH_OVERLAYS = {
  ...{ paper: "paper()", object: "shadowOfObject()", depth: "depthColor()", mesh: "wire(border)", shaded: "plaster()" },
};

export const MESH_VERTEX_SHADER = `#version 300 es
precision highp float;
layout(location = 0) in vec3 a_position;   // camera frame, mm
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec2 a_seen;       // confidence (2 less where the mesh is loose), fraction not covered by something else
layout(location = 3) in vec2 a_uv;
layout(location = 4) in float a_diagonal;  // corner opposite the edge that only halves a cell of the grid; -1 for none
layout(location = 5) in float a_light;     // on a painted paper, its power
${PROJECTION_GLSL}
out vec3 v_position;
out vec3 v_normal;
out vec2 v_seen;
out vec2 v_uv;
out vec2 v_pixel;
out vec3 v_corner;
out float v_light;
flat out int v_diagonal;

void main() {
  v_diagonal = int(a_diagonal);
  v_light = a_light;
  v_position = a_position;
  v_normal = a_normal;
  v_seen = a_seen;
  v_uv = a_uv;
  int corner = gl_VertexID % 3;
  v_corner = vec3(corner == 0, corner == 1, corner == 2);
  v_pixel = imagePixel(a_position);
  gl_Position = projected(a_position);
}`;

/** Nothing but depth: of all of the sheet, or of what something covers. */
export const DEPTH_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform bool u_coveredOnly;
in vec2 v_seen;
in vec3 v_position;
in vec3 v_normal;
in vec2 v_uv;
in vec2 v_pixel;
in vec3 v_corner;
out vec4 o_color;
void main() {
  if (u_coveredOnly && v_seen.y > 0.5) discard;
  o_color = vec4(0.0);
}`;

/** Luminance seen and luminance printed, in linear light, weighted by how much of the print is seen there. */
export const LIGHT_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_frame;         // the camera's image, sRGB, as small as the picture of the light
uniform sampler2D u_print;         // the template's picture, sRGB, mipmapped
uniform vec2 u_frameSize;          // pixels
uniform vec3 u_view;
in vec2 v_seen;
in vec2 v_uv;
in vec2 v_pixel;
in vec3 v_position;
in vec3 v_normal;
in vec3 v_corner;
out vec4 o_light;
${PAPERS_GLSL}
void main() {
  const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
  vec2 border = min(v_uv, 1.0 - v_uv) / max(fwidth(v_uv), vec2(1e-5));
  float weight = smoothstep(0.0, 1.5, min(border.x, border.y)) * smoothstep(0.4, 0.9, v_seen.y);
  if (!gl_FrontFacing) weight = 0.0;
  vec3 seen = linearFromDisplay(texture(u_frame, v_pixel / u_frameSize).rgb);
  vec3 printed = linearFromDisplay(texture(u_print, v_uv).rgb);
  o_light = vec4(dot(seen, luminance), dot(printed, luminance), 1.0, 1.0) * weight;
}`;

/* How much brighter the image is than the print, by the sums of both. */
const LIGHT_GLSL = `
float lightOf(vec3 light) {
  if (light.z < 1e-3) return 1.0;
  light /= light.z;
  return clamp((light.x + 0.02) / (light.y + 0.02), 0.0, 2.5);
}`;

/** A Gaussian along one direction, exp(-i^2 / 9) for i = -4..=4: two neighbours in one bilinear sample between them. */
export const BLUR_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_light;
uniform vec2 u_step;               // one pixel along the direction, texture coordinates
uniform vec2 u_targetSize;         // pixels
out vec4 o_light;
void main() {
  vec2 at = gl_FragCoord.xy / u_targetSize;
  vec4 near = texture(u_light, at - 1.4174 * u_step) + texture(u_light, at + 1.4174 * u_step);
  vec4 far = texture(u_light, at - 3.3148 * u_step) + texture(u_light, at + 3.3148 * u_step);
  o_light = (texture(u_light, at) + 1.5360 * near + 0.5369 * far) / 5.1458;
}`;

/**
 * What is drawn where the mesh is.
 *
 * @param {MeshOverlay} overlay
 * @param {PaperSource} paper
 */
export const meshFragmentShader = (overlay, paper) => `#version 300 es
precision highp float;
precision highp int;
uniform sampler2D u_light;         // blurred sums
uniform sampler2D u_heat;
uniform vec2 u_frameSize;          // pixels
uniform float u_strength;
uniform vec2 u_sheetMm;
uniform vec3 u_tint;               // of a painted paper, its power
uniform vec3 u_depthScale;         // near, far, contour step, mm
uniform float u_lineWidth;         // pixels
in vec3 v_position;
in vec3 v_normal;
in vec2 v_seen;
in vec2 v_uv;
in vec2 v_pixel;
in vec3 v_corner;
in float v_light;
flat in int v_diagonal;
out vec4 o_color;                  // premultiplied
${paperGlsl(paper)}
${overlay === "object" ? SHADOW_GLSL + SHADOW_ON_SHEET_GLSL : ""}
${LIGHT_GLSL}

vec4 wire(vec2 border) {
  vec3 distances = v_corner / max(fwidth(v_corner), vec3(1e-5));
  vec3 lines = 1.0 - smoothstep(0.5 * u_lineWidth - 0.5, 0.5 * u_lineWidth + 0.5, distances);
  // Lines that only halve cells step back, and all of them where they would run into each other.
  if (v_diagonal >= 0) lines[v_diagonal] *= 0.3;
  float triangle = 1.0 / max(max(fwidth(v_corner.x), fwidth(v_corner.y)), fwidth(v_corner.z));
  float line = max(max(lines.x, lines.y), lines.z) * mix(0.6, 0.85, smoothstep(3.0, 10.0, triangle));
  float rim = 1.0 - smoothstep(u_lineWidth - 0.5, u_lineWidth + 0.5, min(border.x, border.y));
  bool isLoose = v_seen.x < -0.5;
  vec3 tone = mix(vec3(1.0, 0.56, 0.36), vec3(0.45, 1.0, 0.82), smoothstep(0.15, 0.6, v_seen.x + (isLoose ? 2.0 : 0.0)));
  float covered = mix(0.35, 1.0, smoothstep(0.3, 0.7, v_seen.y));
  float ink = max(line, rim) * covered;
  // Lines are broken where the mesh is loose.
  if (isLoose && fract((gl_FragCoord.x + gl_FragCoord.y) / (10.0 * u_lineWidth)) > 0.5) ink = 0.0;
  // A veil behind the lines, so that they are read on any print.
  float veil = 0.42 * covered;
  return vec4(mix(vec3(0.03, 0.06, 0.075), tone, ink) * max(ink, veil), max(ink, veil));
}

vec4 plaster() {
  vec3 normal = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 toEye = normalize(-v_position);
  vec3 key = normalize(vec3(-0.62, -0.62, -0.48));
  vec3 fill = normalize(vec3(0.8, 0.1, -0.6));
  float diffuse = max(dot(normal, key), 0.0);
  float gloss = pow(max(dot(normal, normalize(key + toEye)), 0.0), 60.0);
  vec3 base = gl_FrontFacing ? vec3(0.74, 0.71, 0.64) : vec3(0.62, 0.16, 0.085);
  // Steeper than a matt surface falls off, so that a gentle bend is seen.
  vec3 light = pow(diffuse, 1.6) * vec3(1.12, 1.04, 0.92) + 0.16 * max(dot(normal, fill), 0.0) * vec3(0.5, 0.75, 1.0)
    + (0.15 - 0.07 * normal.y) * vec3(0.58, 0.68, 0.78);
  vec2 mm = v_uv * u_sheetMm;
  vec2 slope = max(fwidth(mm), vec2(1e-4));
  vec2 line = abs(fract((mm - 0.5 * u_sheetMm) / 15.0 + 0.5) - 0.5) * 15.0 / slope;
  float grid = 1.0 - smoothstep(0.3, 1.3, min(line.x, line.y));
  float cellPixels = 15.0 / max(slope.x, slope.y);
  base *= 1.0 - 0.34 * grid * smoothstep(4.0, 12.0, cellPixels);
  return vec4(displayFromLinear(base * light + 0.07 * gloss), 1.0);
}

vec4 depthColor() {
  vec3 color = texture(u_heat, vec2((v_position.z - u_depthScale.x) / (u_depthScale.y - u_depthScale.x), 0.5)).rgb;
  float level = v_position.z / u_depthScale.z;
  float slope = max(fwidth(level), 1e-4);
  float line = 1.0 - smoothstep(0.5 * slope, 1.6 * slope, abs(fract(level + 0.5) - 0.5));
  float dense = 1.0 - smoothstep(0.1, 0.35, slope);
  float luminance = dot(color, vec3(0.21, 0.72, 0.07));
  return vec4(mix(color, luminance > 0.35 ? vec3(0.12, 0.07, 0.16) : vec3(1.0), 0.4 * line * dense), 1.0) * 0.94;
}

vec4 paper() {
  // The blank back stays as the camera sees it; it hides what is behind all the same.
  if (!gl_FrontFacing) return vec4(0.0);
  vec2 stride = fwidth(v_uv) * u_sheetMm;
  ${
    paper === "painted"
      ? "float light = v_light;"
      : "float light = lightOf(texture(u_light, vec2(v_pixel.x / u_frameSize.x, 1.0 - v_pixel.y / u_frameSize.y)).rgb);"
  }
  return vec4(litPaper(v_uv, max(max(stride.x, stride.y), 1e-3), light * u_tint), 1.0) * smoothstep(0.3, 0.7, v_seen.y);
}

void main() {
  // Distance to the sheet's border, pixels: its edge is drawn softly.
  vec2 border = min(v_uv, 1.0 - v_uv) / max(fwidth(v_uv), vec2(1e-6));
  float inside = ${overlay === "mesh" ? "1.0" : "clamp(min(border.x, border.y) + 0.25, 0.0, 1.0)"};
  vec4 color = ${MESH_OVERLAYS[overlay]};
  o_color = color * inside * u_strength;
}`;
