// The canonical image: the one imaging geometry the network was trained with, and where it lies in a
// camera's image. Maps live on its pixels, so this is what an overlay needs.

/** Columns of the canonical image and of maps, of an upright camera rows. */
export const CANONICAL_WIDTH = 480;
/** Rows of the canonical image and of maps, of an upright camera columns. */
export const CANONICAL_HEIGHT = 270;
/** Focal length of the canonical camera, pixels; its principal point is the image's centre. */
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

/**
 * Position in a camera's image, pixels, of a position in the canonical image, pixels.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export function imageFromCanonical(camera, x, y) {
  const { width, height } = canonicalSize(camera);
  const ray = [(x - width / 2) / CANONICAL_FOCAL, (y - height / 2) / CANONICAL_FOCAL];
  const [dx, dy] = distort(camera.distortion ?? [0, 0, 0, 0, 0], ray[0], ray[1]);
  return [dx * camera.fx + camera.cx, dy * camera.fy + camera.cy];
}

/**
 * Position in the canonical image, pixels, of a position in a camera's image, pixels: the inverse of
 * {@link imageFromCanonical}, by fixed-point iteration where the lens distorts.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export function canonicalFromImage(camera, x, y) {
  const distorted = [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy];
  let ray = [...distorted];
  const distortion = camera.distortion ?? [0, 0, 0, 0, 0];
  for (let i = 0; i < 50 && distortion.some((k) => k !== 0); i++) {
    const [dx, dy] = distort(distortion, ray[0], ray[1]);
    const step = [distorted[0] - dx, distorted[1] - dy];
    ray = [ray[0] + step[0], ray[1] + step[1]];
    if (step[0] * step[0] + step[1] * step[1] < 1e-24) break;
  }
  const { width, height } = canonicalSize(camera);
  return [ray[0] * CANONICAL_FOCAL + width / 2, ray[1] * CANONICAL_FOCAL + height / 2];
}

/**
 * The part of a camera's image that the network sees, pixels: the canonical image's rectangle (lens distortion
 * left aside) cut to the image. A wide image reaches beyond it.
 *
 * @param {Camera} camera
 * @returns {{ left: number, top: number, right: number, bottom: number }}
 */
export function visibleRegion({ width, height, fx, fy, cx, cy }) {
  const canonical = canonicalSize({ width, height });
  const [halfWidth, halfHeight] = [canonical.width / 2 / CANONICAL_FOCAL, canonical.height / 2 / CANONICAL_FOCAL];
  return {
    left: Math.max(0, cx - halfWidth * fx),
    top: Math.max(0, cy - halfHeight * fy),
    right: Math.min(width, cx + halfWidth * fx),
    bottom: Math.min(height, cy + halfHeight * fy),
  };
}
