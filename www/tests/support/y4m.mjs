// Uncompressed video files, which Chromium plays as a camera.

/**
 * A planar frame: luma of each pixel, colour of each two by two (their mean), in the limited range of BT.601, what Chromium takes camera
 * frames for. In plain loops: a film has tens of millions of pixels.
 *
 * @param {{ width: number, height: number, rgb: Uint8Array }} picture even sides
 */
function planes({ width, height, rgb }) {
  const y = new Uint8Array(width * height);
  for (let pixel = 0, at = 0; pixel < y.length; pixel++, at += 3)
    y[pixel] = 16.5 + (65.481 * rgb[at] + 128.553 * rgb[at + 1] + 24.966 * rgb[at + 2]) / 255;
  const [cb, cr] = [0, 1].map(() => new Uint8Array((width / 2) * (height / 2)));
  for (let row = 0, i = 0; row < height; row += 2) {
    for (let at = 3 * row * width, end = at + 3 * width; at < end; at += 6, i++) {
      const below = at + 3 * width;
      // Sums of four, of 1020 at most.
      const r = rgb[at] + rgb[at + 3] + rgb[below] + rgb[below + 3];
      const g = rgb[at + 1] + rgb[at + 4] + rgb[below + 1] + rgb[below + 4];
      const b = rgb[at + 2] + rgb[at + 5] + rgb[below + 2] + rgb[below + 5];
      cb[i] = 128.5 + (-37.797 * r - 74.203 * g + 112 * b) / 1020;
      cr[i] = 128.5 + (112 * r - 93.786 * g - 18.214 * b) / 1020;
    }
  }
  return [y, cb, cr];
}

/**
 * @param {{ width: number, height: number, rgb: Uint8Array }[]} pictures all of one size
 * @param {number} framesPerSecond
 * @returns {Buffer}
 */
export function y4m(pictures, framesPerSecond) {
  const [{ width, height }] = pictures;
  const header = Buffer.from(`YUV4MPEG2 W${width} H${height} F${framesPerSecond}:1 Ip A1:1 C420jpeg\n`);
  const mark = Buffer.from("FRAME\n");
  return Buffer.concat([header, ...pictures.flatMap((picture) => [mark, ...planes(picture)])]);
}
