// The flat picture of a print, from a photograph of it and its four corners.

import { DeepSftError } from "../error.js";

/**
 * A print's corners in a photograph, (x, y) in pixels from the photograph's top left corner: the print's top left, top right,
 * bottom right and bottom left.
 *
 * @typedef {readonly [readonly [number, number], readonly [number, number], readonly [number, number], readonly [number, number]]} PrintCorners
 */

/** Samples along each side of a pixel of the flat picture, at most. */
const MAX_SAMPLES = 4;

/**
 * Whether four corners run clockwise around a convex quadrilateral: only such a one is the view of a print's front.
 *
 * @param {PrintCorners} corners
 */
export function isPrintOutline(corners) {
  return corners.every(([x, y], i) => {
    const [[x1, y1], [x2, y2]] = [corners[(i + 1) % 4], corners[(i + 2) % 4]];
    return (x1 - x) * (y2 - y1) - (y1 - y) * (x2 - x1) > 0;
  });
}

/**
 * Width over height of a flat print, from its corners in a photograph by a known camera: the columns of K⁻¹H are the print's
 * two axes in space, as long as its sides (Zhang and He, Whiteboard scanning and image enhancement, 2007, section 3).
 *
 * @param {PrintCorners} corners
 * @param {{ fx: number, fy: number, cx: number, cy: number }} camera pixels of the same photograph; its distortion is neglected
 * @throws {DeepSftError} `invalid-argument` for corners that are no {@link isPrintOutline outline}
 */
export function printAspect(corners, { fx, fy, cx, cy }) {
  const h = outlineHomography(corners, 1, 1);
  const side = (/** @type {0 | 1} */ k) => {
    const [u, v, w] = [h[k], h[3 + k], h[6 + k]];
    return Math.hypot((u - cx * w) / fx, (v - cy * w) / fy, w);
  };
  return side(0) / side(1);
}

/**
 * The print as a flat picture.
 *
 * @param {ImageData} photograph
 * @param {PrintCorners} corners
 * @param {number} width of the flat picture, pixels
 * @param {number} height
 * @returns {ImageData} opaque where the photograph is
 * @throws {DeepSftError} `invalid-argument` for corners that are no {@link isPrintOutline outline}
 */
export function rectifyPicture(photograph, corners, width, height) {
  const h = outlineHomography(corners, width, height);
  const flat = new ImageData(width, height);
  // Photograph's pixels along a pixel of the flat picture, where they are most.
  const sides = corners.map(([x, y], i) => Math.hypot(corners[(i + 1) % 4][0] - x, corners[(i + 1) % 4][1] - y));
  const shrinkage = Math.max(sides[0] / width, sides[2] / width, sides[1] / height, sides[3] / height);
  const samples = Math.min(MAX_SAMPLES, Math.max(1, Math.ceil(shrinkage)));
  const sum = new Float64Array(4);
  for (let y = 0, at = 0; y < height; y++) {
    for (let x = 0; x < width; x++, at += 4) {
      sum.fill(0);
      for (let j = 0; j < samples; j++) {
        const v = y + (j + 0.5) / samples;
        for (let i = 0; i < samples; i++) {
          const u = x + (i + 0.5) / samples;
          const w = h[6] * u + h[7] * v + h[8];
          addSample(sum, photograph, (h[0] * u + h[1] * v + h[2]) / w, (h[3] * u + h[4] * v + h[5]) / w);
        }
      }
      for (let k = 0; k < 4; k++) flat.data[at + k] = sum[k] / samples ** 2;
    }
  }
  return flat;
}

/**
 * The homography from a rectangle of `width` x `height` at the origin to the corners, row-major (Heckbert, Fundamentals of texture mapping and
 * image warping, 1989, section 2.2.3).
 *
 * @param {PrintCorners} corners
 * @param {number} width
 * @param {number} height
 */
export function outlineHomography(corners, width, height) {
  if (!isPrintOutline(corners)) throw new DeepSftError("invalid-argument", `The corners ${JSON.stringify(corners)} are not those of a print seen from its front.`);
  const [[x0, y0], [x1, y1], [x2, y2], [x3, y3]] = corners;
  const [ax, ay, bx, by] = [x1 - x2, y1 - y2, x3 - x2, y3 - y2];
  const [sx, sy] = [x0 - x1 + x2 - x3, y0 - y1 + y2 - y3];
  const area = ax * by - bx * ay;
  const [g, h] = [(sx * by - bx * sy) / area, (ax * sy - sx * ay) / area];
  const unit = [x1 - x0 + g * x1, x3 - x0 + h * x3, x0, y1 - y0 + g * y1, y3 - y0 + h * y3, y0, g, h, 1];
  return unit.map((value, i) => value / [width, height, 1][i % 3]);
}

/**
 * Adds a bilinear sample; beyond the photograph's border lies the border's colour.
 *
 * @param {Float64Array} sum RGBA
 * @param {ImageData} photograph
 * @param {number} x pixels
 * @param {number} y
 */
function addSample(sum, { data, width, height }, x, y) {
  const [column, row] = [Math.min(width - 1, Math.max(0, x - 0.5)), Math.min(height - 1, Math.max(0, y - 0.5))];
  const [left, top] = [Math.floor(column), Math.floor(row)];
  const [right, below] = [Math.min(width - 1, left + 1), Math.min(height - 1, top + 1)];
  const [a, b] = [column - left, row - top];
  const [p, q, r, s] = [4 * (top * width + left), 4 * (top * width + right), 4 * (below * width + left), 4 * (below * width + right)];
  const [wp, wq, wr, ws] = [(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b];
  for (let k = 0; k < 4; k++) sum[k] += wp * data[p + k] + wq * data[q + k] + wr * data[r + k] + ws * data[s + k];
}

