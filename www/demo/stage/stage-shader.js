// The stage's shader: one pass that draws the frame and the overlay for every pixel of the canvas.

import { LENS_GLSL } from "deepsft";
import { PAINTED_POWER, paperGlsl } from "../graphics/papers.js";

/** @import { PaperSource } from "../graphics/papers.js" */

export const VERTEX_SHADER = `#version 300 es
void main() {
  // One triangle that covers the canvas.
  gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0);
}`;

/** @typedef {"paper" | "depth" | "mask"} MapOverlay */

/** @type {Readonly<Record<MapOverlay, string>>} */
export const MAP_OVERLAYS = {
  paper: "color = mix(color, paperOverlay(maps, pixelMm, canonical), inside);",
  depth: "color = mix(color, depthOverlay(maps, levelSlope), 0.94 * inside);",
  mask: `color = mix(color, u_accent * (0.35 + 0.65 * dot(color, vec3(0.3, 0.6, 0.1))), 0.72 * inside);
  float rim = 1.0 - smoothstep(1.0, 2.2, abs(maps.coverage - CONTOUR) / edge);
  color = mix(color, vec3(1.0), 0.9 * rim * u_strength);`,
};

/** The overlay of one pixel, drawn from the maps. */
const overlayGlsl = (/** @type {MapOverlay} */ overlay) => `
  vec2 canonical = canonicalFromImage(pixel);
  Maps maps = sampleMaps(canonical);
  float edge = max(fwidth(maps.coverage), 1e-3);
  vec2 stride = fwidth(maps.uv) * u_sheetMm;
  float pixelMm = max(max(stride.x, stride.y), 1e-3);
  float levelSlope = max(fwidth(maps.depth) / u_depthScale.z, 1e-4);
  float inside = clamp((maps.coverage - CONTOUR) / edge + 0.5, 0.0, 1.0) * u_strength;
  ${MAP_OVERLAYS[overlay]}`;

/** Darkens what the network does not see. */
const DIMMED_GLSL = `
  vec2 beyond = max(max(u_region.xy - pixel, pixel - u_region.zw), 0.0) * u_view.z;
  color *= mix(1.0, 0.42, smoothstep(0.0, 1.5, max(beyond.x, beyond.y)));`;

/** What fills the canvas beside the image: the image again, larger, far out of focus and dark. */
export const BACKDROP_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_blurred;       // the camera's image, sRGB, out of focus
uniform vec2 u_canvasSize;         // pixels
uniform vec2 u_frameSize;          // pixels
out vec4 o_color;
void main() {
  vec2 canvas = vec2(gl_FragCoord.x, u_canvasSize.y - gl_FragCoord.y);
  vec2 aspect = u_canvasSize / u_frameSize;
  vec2 uv = 0.5 + (canvas - 0.5 * u_canvasSize) / (u_frameSize * max(aspect.x, aspect.y));
  o_color = vec4(mix(vec3(0.055, 0.063, 0.075), texture(u_blurred, uv).rgb, 0.22), 1.0);
}`;

/**
 * The frame, and over it what is drawn from the maps.
 *
 * @param {"plain" | MapOverlay} overlay
 * @param {PaperSource} paper
 * @param {"whole" | "part"} region how much of the frame the network sees
 */
export const stageFragmentShader = (overlay, paper, region) => `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D u_frame;         // the camera's image, sRGB
uniform sampler2D u_depth;         // canonical, mm
uniform sampler2D u_registration;  // canonical, (u, v)
uniform sampler2D u_coverage;      // canonical, the mask softened, 0 to 1
uniform sampler2D u_shading;       // canonical, coarse
uniform sampler2D u_heat;          // colour scale of depth, near to far
uniform vec2 u_canvasSize;         // pixels
uniform vec3 u_view;               // canvas = image * z + xy, pixels from the top left
uniform vec2 u_frameSize;          // pixels
uniform vec4 u_camera;             // fx, fy, cx, cy, pixels
uniform vec4 u_region;             // part of the image the network sees: left, top, right, bottom
uniform vec3 u_canonical;          // width, height, focal length, pixels
uniform float u_strength;          // of the overlay, 0 to 1
uniform vec2 u_sheetMm;
uniform vec3 u_tint;
uniform vec3 u_depthScale;         // near, far, contour step, mm
uniform vec3 u_accent;             // sRGB
out vec4 o_color;

${paperGlsl(paper)}

${LENS_GLSL}

/* The canonical warp's inverse: K_canonical undistort(K^-1 p). */
vec2 canonicalFromImage(vec2 pixel) {
  return undistorted((pixel - u_camera.zw) / u_camera.xy) * u_canonical.z + 0.5 * u_canonical.xy;
}

/* The contour of the softened mask that is drawn: a little outside, where the sheet's white rim would show. */
const float CONTOUR = 0.42;

struct Maps {
  float coverage;
  vec2 uv;
  float depth;
};

/* Maps between their pixels: cubic B-spline, which leaves no steps; pixels outside the object do not count. */
Maps sampleMaps(vec2 canonical) {
  Maps sum = Maps(0.0, vec2(0.0), 0.0);
  if (texture(u_coverage, canonical / u_canonical.xy).r < 0.02) return sum;
  ivec2 limit = ivec2(u_canonical.xy) - 1;
  vec2 base = floor(canonical - 0.5);
  vec2 f = canonical - 0.5 - base;
  vec2 g = 1.0 - f;
  vec2 weights[4] = vec2[4](g * g * g / 6.0, (4.0 - 6.0 * f * f + 3.0 * f * f * f) / 6.0, (4.0 - 6.0 * g * g + 3.0 * g * g * g) / 6.0, f * f * f / 6.0);
  float inside = 0.0;
  for (int j = 0; j < 4; j++) {
    for (int i = 0; i < 4; i++) {
      ivec2 at = clamp(ivec2(base) + ivec2(i - 1, j - 1), ivec2(0), limit);
      float w = weights[i].x * weights[j].y;
      sum.coverage += w * texelFetch(u_coverage, at, 0).r;
      float depth = texelFetch(u_depth, at, 0).r;
      if (depth <= 0.0) continue;
      inside += w;
      sum.uv += w * texelFetch(u_registration, at, 0).rg;
      sum.depth += w * depth;
    }
  }
  sum.uv /= max(inside, 1e-4);
  sum.depth /= max(inside, 1e-4);
  sum.coverage *= step(1e-3, inside);
  return sum;
}

vec3 frameColor(vec2 pixel) {
  return texture(u_frame, pixel / u_frameSize).rgb;
}

vec3 paperOverlay(Maps maps, float pixelMm, vec2 canonical) {
  vec3 light = texture(u_shading, canonical / u_canonical.xy).r * u_tint;
  return litPaper(maps.uv, pixelMm, ${paper === "painted" ? `pow(light, vec3(${PAINTED_POWER}))` : "light"});
}

vec3 depthOverlay(Maps maps, float slope) {
  vec3 color = texture(u_heat, vec2((maps.depth - u_depthScale.x) / (u_depthScale.y - u_depthScale.x), 0.5)).rgb;
  float level = maps.depth / u_depthScale.z;
  float line = 1.0 - smoothstep(0.5 * slope, 1.6 * slope, abs(fract(level + 0.5) - 0.5));
  float dense = 1.0 - smoothstep(0.1, 0.35, slope);
  float luminance = dot(color, vec3(0.21, 0.72, 0.07));
  return mix(color, luminance > 0.35 ? vec3(0.12, 0.07, 0.16) : vec3(1.0), 0.4 * line * dense);
}

void main() {
  vec2 canvas = vec2(gl_FragCoord.x, u_canvasSize.y - gl_FragCoord.y);
  vec2 pixel = (canvas - u_view.xy) / u_view.z;
  vec3 color = frameColor(pixel);
${region === "whole" ? "" : DIMMED_GLSL}
${overlay === "plain" ? "" : overlayGlsl(overlay)}
  o_color = vec4(color, 1.0);
}`;
