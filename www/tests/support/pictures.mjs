// Pictures of others: parts of them, and as other cameras would have taken them.

/** @typedef {{ width: number, height: number, rgb: Uint8Array }} RgbPicture */

/**
 * The middle of a picture.
 *
 * @param {RgbPicture} picture
 * @param {{ width: number, height: number }} size
 * @returns {RgbPicture}
 */
export function cut(picture, { width, height }) {
  const [left, top] = [(picture.width - width) / 2, (picture.height - height) / 2];
  const rows = Array.from({ length: height }, (_, y) => {
    const from = 3 * ((top + y) * picture.width + left);
    return picture.rgb.subarray(from, from + 3 * width);
  });
  return { width, height, rgb: Buffer.concat(rows) };
}

/**
 * Writes the colour of a place in a picture, (0, 0) being the middle of its first pixel, to `to` at `at`: interpolated, beyond the
 * border that of the border.
 *
 * @param {RgbPicture} picture
 * @param {number} x
 * @param {number} y
 * @param {Uint8Array} to
 * @param {number} at
 */
export function sample({ width, height, rgb }, x, y, to, at) {
  const [px, py] = [Math.min(Math.max(x, 0), width - 1.001), Math.min(Math.max(y, 0), height - 1.001)];
  const [left, top] = [Math.floor(px), Math.floor(py)];
  const [a, b] = [px - left, py - top];
  const from = 3 * (top * width + left);
  const below = from + 3 * width;
  for (let k = 0; k < 3; k++)
    to[at + k] = Math.round(
      (rgb[from + k] * (1 - a) + rgb[from + 3 + k] * a) * (1 - b) + (rgb[below + k] * (1 - a) + rgb[below + 3 + k] * a) * b,
    );
}

/**
 * What a fisheye sees of what a pinhole camera saw, black where that saw nothing.
 *
 * @param {RgbPicture} picture
 * @param {{ fx: number, fy: number, cx: number, cy: number }} pinhole its camera
 * @param {{ width: number, height: number, fx: number, fy: number, cx: number, cy: number, fisheye: number[] }} camera
 * @returns {RgbPicture}
 */
export function throughFisheye(picture, pinhole, camera) {
  const { width, height } = camera;
  const rgb = new Uint8Array(3 * width * height);
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const [x, y] = [(column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy];
      const radius = Math.hypot(x, y);
      const longer = radius === 0 ? 1 : Math.tan(angleAt(camera.fisheye, radius)) / radius;
      const [px, py] = [pinhole.fx * x * longer + pinhole.cx - 0.5, pinhole.fy * y * longer + pinhole.cy - 0.5];
      if (px < -0.5 || py < -0.5 || px > picture.width - 0.5 || py > picture.height - 0.5) continue;
      sample(picture, px, py, rgb, 3 * (row * width + column));
    }
  }
  return { width, height, rgb };
}

/**
 * Where a fisheye sees points, by the definition of OpenCV's `cv::fisheye`.
 *
 * @param {ArrayLike<number>} vertices (x, y, z) each, camera frame
 * @param {{ fx: number, fy: number, cx: number, cy: number, fisheye: number[] }} camera
 * @returns {[number, number][]} pixels
 */
export function seenByFisheye(vertices, { fx, fy, cx, cy, fisheye }) {
  return Array.from({ length: vertices.length / 3 }, (_, i) => {
    const [x, y, z] = [vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]];
    const across = Math.hypot(x, y);
    const radius = radiusAt(fisheye, Math.atan2(across, z));
    return [(fx * radius * x) / across + cx, (fy * radius * y) / across + cy];
  });
}

function radiusAt([k1, k2, k3, k4], angle) {
  const square = angle * angle;
  return angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))));
}

/** By halving. */
function angleAt(fisheye, radius) {
  let [low, high] = [0, 1.5];
  for (let i = 0; i < 40; i++) {
    const middle = (low + high) / 2;
    if (radiusAt(fisheye, middle) < radius) low = middle;
    else high = middle;
  }
  return low;
}
