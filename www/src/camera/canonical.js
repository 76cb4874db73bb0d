// The canonical image: the one imaging geometry the network was trained with, and where it lies in a
// camera's image. Maps live on its pixels, so this is what an overlay needs.

import { distorted, undistorted } from "./lens.js";

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
 */
export function canonicalSize({ width, height }) {
  return height > width
    ? { width: CANONICAL_HEIGHT, height: CANONICAL_WIDTH }
    : { width: CANONICAL_WIDTH, height: CANONICAL_HEIGHT };
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
  const [dx, dy] = distorted(camera, ray[0], ray[1]);
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
  const points = new Float32Array((2 * vertices.length) / 3);
  for (let i = 0; 2 * i < points.length; i++) {
    const depth = vertices[3 * i + 2];
    const [x, y] = distorted(camera, vertices[3 * i] / depth, vertices[3 * i + 1] / depth);
    points[2 * i] = scale * (x * camera.fx + camera.cx);
    points[2 * i + 1] = scale * (y * camera.fy + camera.cy);
  }
  return points;
}

/**
 * Position in the canonical image, pixels, of a position in a camera's image, pixels: the inverse of
 * {@link imageFromCanonical}.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @param {number} [focal] as there
 * @returns {[number, number]}
 */
export function canonicalFromImage(camera, x, y, focal = CANONICAL_FOCAL) {
  const ray = undistorted(camera, (x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
  const { width, height } = canonicalSize(camera);
  return [ray[0] * focal + width / 2, ray[1] * focal + height / 2];
}
