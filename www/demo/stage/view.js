// Where the image lies on the canvas.

import { verticesInImage, visibleRegion } from "deepsft";

/** @import { SourcedCamera } from "deepsft" */

/** How much larger the image may be than would show all that the network sees, to cover the canvas. */
const MAX_CUT = 1.12;

/**
 * Where the image lies on the canvas: canvas = image * scale + (left, top), in the canvas's pixels. It covers the
 * canvas as far as that cuts little away of what the network sees.
 *
 * @param {{ width: number, height: number, top: number, bottom: number }} canvas its size, and what of it is covered by controls
 * @param {SourcedCamera} camera
 */
export function viewOf(canvas, camera) {
  const region = visibleRegion(camera);
  const [regionWidth, regionHeight] = [region.right - region.left, region.bottom - region.top];
  const free = canvas.height - canvas.top - canvas.bottom;
  const cover = Math.max(canvas.width / camera.width, canvas.height / camera.height);
  const fit = Math.min(canvas.width / regionWidth, Math.max(free, canvas.height / 2) / regionHeight);
  const scale = Math.min(cover, MAX_CUT * fit);
  const place = (
    /** @type {number} */ size,
    /** @type {number} */ length,
    /** @type {number} */ from,
    /** @type {number} */ to,
    /** @type {number} */ centre,
  ) => {
    const start = centre - ((from + to) / 2) * scale;
    // An image that is larger than the canvas leaves no border.
    return length * scale >= size ? Math.min(0, Math.max(size - length * scale, start)) : start;
  };
  const centreY = canvas.top + free / 2;
  return {
    scale,
    left: place(canvas.width, camera.width, region.left, region.right, canvas.width / 2),
    top: place(canvas.height, camera.height, region.top, region.bottom, centreY),
    region,
  };
}

/**
 * Which place of the image is seen at a place of the canvas.
 *
 * @param {Parameters<typeof viewOf>[0]} canvas
 * @param {SourcedCamera} camera
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]} image pixels
 */
export function imagePlaceOf(canvas, camera, x, y) {
  const { scale, left, top } = viewOf(canvas, camera);
  return [(x - left) / scale, (y - top) / scale];
}

/**
 * Where on the page, in CSS pixels, the network looks.
 *
 * @param {Parameters<typeof viewOf>[0]} page
 * @param {SourcedCamera} camera
 * @returns {{ left: number, top: number, width: number, height: number, partial: boolean }} partial: the image reaches beyond
 */
export function regionOnPage(page, camera) {
  const { scale, left, top, region } = viewOf(page, camera);
  const fraction = ((region.right - region.left) * (region.bottom - region.top)) / (camera.width * camera.height);
  return {
    left: left + region.left * scale,
    top: top + region.top * scale,
    width: (region.right - region.left) * scale,
    height: (region.bottom - region.top) * scale,
    partial: fraction < 0.95,
  };
}

/**
 * The box around a mesh in the image, cut to the image.
 *
 * @param {Float32Array} vertices (x, y, z) each, camera frame
 * @param {SourcedCamera} camera
 * @returns {{ left: number, top: number, right: number, bottom: number }} pixels
 */
export function boundsInImage(vertices, camera) {
  const points = verticesInImage(vertices, camera, 1);
  const box = { left: camera.width, top: camera.height, right: 0, bottom: 0 };
  for (let i = 0; i < points.length; i += 2) {
    box.left = Math.min(box.left, Math.max(0, points[i]));
    box.right = Math.max(box.right, Math.min(camera.width, points[i]));
    box.top = Math.min(box.top, Math.max(0, points[i + 1]));
    box.bottom = Math.max(box.bottom, Math.min(camera.height, points[i + 1]));
  }
  return box;
}
