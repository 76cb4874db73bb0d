// Uncompressed video files, which Chromium plays as a camera.

/** Limited-range BT.601, what Chromium takes camera frames for. */
const luma = (r, g, b) => 16 + (65.481 * r + 128.553 * g + 24.966 * b) / 255;
const blueDifference = (r, g, b) => 128 + (-37.797 * r - 74.203 * g + 112 * b) / 255;
const redDifference = (r, g, b) => 128 + (112 * r - 93.786 * g - 18.214 * b) / 255;

/**
 * A planar frame: luma of each pixel, colour of each two by two (their mean).
 *
 * @param {{ width: number, height: number, rgb: Uint8Array }} picture even sides
 */
function planes({ width, height, rgb }) {
  const of = (value, pixel) => value(rgb[3 * pixel], rgb[3 * pixel + 1], rgb[3 * pixel + 2]);
  const y = Uint8Array.from({ length: width * height }, (_, pixel) => Math.round(of(luma, pixel)));
  const chroma = (difference) => {
    const plane = new Uint8Array((width / 2) * (height / 2));
    for (let row = 0, i = 0; row < height; row += 2) {
      for (let pixel = row * width; pixel < (row + 1) * width; pixel += 2, i++) {
        const above = of(difference, pixel) + of(difference, pixel + 1);
        plane[i] = Math.round((above + of(difference, pixel + width) + of(difference, pixel + width + 1)) / 4);
      }
    }
    return plane;
  };
  return [y, chroma(blueDifference), chroma(redDifference)];
}

/**
 * @param {{ width: number, height: number, rgb: Uint8Array }[]} pictures all of one size
 * @param {number} framesPerSecond
 * @returns {Buffer}
 */
export function y4m(pictures, framesPerSecond) {
  const [{ width, height }] = pictures;
  const header = Buffer.from(`YUV4MPEG2 W${width} H${height} F${framesPerSecond}:1 Ip A1:1 C420jpeg\n`);
  return Buffer.concat([header, ...pictures.flatMap((picture) => [Buffer.from("FRAME\n"), ...planes(picture)])]);
}
