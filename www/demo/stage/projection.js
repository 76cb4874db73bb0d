// From the camera's frame to the canvas, in GLSL: what all that is drawn in space shares.

import { LENS_GLSL, lensUniform } from "deepsft";

/** Distances between which surfaces hide each other, mm. */
const NEAR_MM = 20;
const FAR_MM = 10_000;

/** `projected(p)` of a point (mm, camera frame), and `imagePixel(p)`. */
export const PROJECTION_GLSL = `
uniform vec4 u_camera;             // fx, fy, cx, cy, pixels
uniform vec3 u_view;               // target = image * z + xy, pixels from the top left
uniform vec2 u_targetSize;         // pixels
${LENS_GLSL}
vec2 imagePixel(vec3 p) { return distorted(p.xy / p.z) * u_camera.xy + u_camera.zw; }
vec4 projected(vec3 p) {
  vec2 target = (imagePixel(p) * u_view.z + u_view.xy) / u_targetSize;
  const float near = ${NEAR_MM}.0, far = ${FAR_MM}.0;
  return vec4(vec2(2.0 * target.x - 1.0, 1.0 - 2.0 * target.y) * p.z,
    (far + near) / (far - near) * p.z - 2.0 * far * near / (far - near), p.z);
}`;

/** @import { SourcedCamera } from "deepsft" */

/**
 * Gives the uniforms of {@link PROJECTION_GLSL}.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {(name: string) => WebGLUniformLocation | null} uniform
 * @param {SourcedCamera} camera
 * @param {[number, number, number]} view
 * @param {[number, number]} targetSize
 */
export function setProjection(gl, uniform, camera, view, targetSize) {
  gl.uniform4f(uniform("u_camera"), camera.fx, camera.fy, camera.cx, camera.cy);
  gl.uniform1fv(uniform("u_lens"), lensUniform(camera));
  gl.uniform3f(uniform("u_view"), ...view);
  gl.uniform2f(uniform("u_targetSize"), ...targetSize);
}
