// The canonical image: the one imaging geometry the network was trained with, and where it lies in a
// camera's image. Maps live on its pixels, so this is what an overlay needs.

/** Columns of the canonical image and of maps, of an upright camera rows. */
export const CANONICAL_WIDTH = 480;
/** Rows of the canonical image and of maps, of an upright camera columns. */
export const CANONICAL_HEIGHT = 270;
/** Focal length of the training camera, pixels; its principal point is the image's centre. Where an object is too near for its angle of view
 * the canonical image has a shorter one: `focal` of an estimate. */
export const CANONICAL_FOCAL = 380;

/** @import { Camera } from "./intrinsics.js" */

/**
 * Columns and rows of the canonical image, and of the maps: the canonical camera is held upright where the camera's image is upright.
 *
 * @param {{ width: number, height: number }} camera
 * @returns {{ width: number, height: number }}
 */
export function canonicalSize({ width, height }) {
  return height > width
    ? { width: CANONICAL_HEIGHT, height: CANONICAL_WIDTH }
    : { width: CANONICAL_WIDTH, height: CANONICAL_HEIGHT };
}

/**
 * Distortion of the normalised image plane, OpenCV's model.
 *
 * @param {readonly number[]} distortion (k1, k2, p1, p2, k3)
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
function distort([k1, k2, p1, p2, k3], x, y) {
  const r2 = x * x + y * y;
  const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y];
}

/** GLSL of the same: `vec2 distorted(vec2 p)`, given by the uniform `u_distortion`. */
export const DISTORTION_GLSL = `
uniform float u_distortion[5];     // k1, k2, p1, p2, k3
vec2 distorted(vec2 p) {
  float r2 = dot(p, p);
  float radial = 1.0 + r2 * (u_distortion[0] + r2 * (u_distortion[1] + r2 * u_distortion[4]));
  return p * radial + vec2(
    2.0 * u_distortion[2] * p.x * p.y + u_distortion[3] * (r2 + 2.0 * p.x * p.x),
    u_distortion[2] * (r2 + 2.0 * p.y * p.y) + 2.0 * u_distortion[3] * p.x * p.y);
}`;

/**
 * Distance from the centre, in focal lengths, of what a fisheye sees at an angle from its axis, and its derivative.
 *
 * @param {readonly number[]} fisheye (k1, k2, k3, k4)
 * @param {number} angle radians
 * @returns {[number, number]}
 */
function fisheyeRadius([k1, k2, k3, k4], angle) {
  const t2 = angle * angle;
  return [
    angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
    1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4))),
  ];
}

/**
 * Position in a camera's image, pixels, of a position in the canonical image, pixels.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @param {number} [focal] of the canonical image, pixels: an estimate's own where the object was too near for the training camera's
 * @returns {[number, number]}
 */
export function imageFromCanonical(camera, x, y, focal = CANONICAL_FOCAL) {
  const { width, height } = canonicalSize(camera);
  const ray = [(x - width / 2) / focal, (y - height / 2) / focal];
  const [dx, dy] = camera.fisheye
    ? scaled(ray, (r) => fisheyeRadius(camera.fisheye ?? [], Math.atan(r))[0])
    : distort(camera.distortion ?? [0, 0, 0, 0, 0], ray[0], ray[1]);
  return [dx * camera.fx + camera.cx, dy * camera.fy + camera.cy];
}

/**
 * Where the vertices of a mesh lie in a camera's image.
 *
 * @param {Float32Array} vertices (x, y, z) each, camera frame
 * @param {Camera} camera
 * @param {number} [scale] of the result
 * @returns {Float32Array} (x, y) each, pixels times the scale
 */
export function verticesInImage(vertices, camera, scale = 1) {
  const { width, height } = canonicalSize(camera);
  const points = new Float32Array((2 * vertices.length) / 3);
  for (let i = 0; 2 * i < points.length; i++) {
    const perMm = CANONICAL_FOCAL / vertices[3 * i + 2];
    const [column, row] = [vertices[3 * i] * perMm + width / 2, vertices[3 * i + 1] * perMm + height / 2];
    const [x, y] = imageFromCanonical(camera, column, row);
    points[2 * i] = x * scale;
    points[2 * i + 1] = y * scale;
  }
  return points;
}

/**
 * Position in the canonical image, pixels, of a position in a camera's image, pixels: the inverse of
 * {@link imageFromCanonical}, by iteration where the lens distorts.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @param {number} [focal] as there
 * @returns {[number, number]}
 */
export function canonicalFromImage(camera, x, y, focal = CANONICAL_FOCAL) {
  const distorted = [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy];
  let ray = camera.fisheye ? fisheyeRay(camera.fisheye, distorted) : [...distorted];
  const distortion = camera.distortion ?? [0, 0, 0, 0, 0];
  for (let i = 0; i < 50 && distortion.some((k) => k !== 0); i++) {
    const [dx, dy] = distort(distortion, ray[0], ray[1]);
    const step = [distorted[0] - dx, distorted[1] - dy];
    ray = [ray[0] + step[0], ray[1] + step[1]];
    if (step[0] * step[0] + step[1] * step[1] < 1e-24) break;
  }
  const { width, height } = canonicalSize(camera);
  return [ray[0] * focal + width / 2, ray[1] * focal + height / 2];
}

/**
 * A vector with another length.
 *
 * @param {number[]} vector
 * @param {(length: number) => number} lengthOf
 * @returns {[number, number]}
 */
function scaled([x, y], lengthOf) {
  const length = Math.hypot(x, y);
  const factor = length === 0 ? 1 : lengthOf(length) / length;
  return [x * factor, y * factor];
}

/**
 * The ray (x, y, 1) that a fisheye brings to a place in focal lengths from the centre, by Newton's method.
 *
 * @param {readonly number[]} fisheye (k1, k2, k3, k4)
 * @param {number[]} distorted
 * @returns {[number, number]}
 */
function fisheyeRay(fisheye, distorted) {
  return scaled(distorted, (radius) => {
    let angle = Math.min(radius, Math.PI / 2);
    for (let i = 0; i < 20; i++) {
      const [actual, slope] = fisheyeRadius(fisheye, angle);
      angle = Math.min(Math.max(angle + (radius - actual) / slope, 0), Math.PI / 2 - 1e-9);
    }
    return Math.tan(angle);
  });
}
