// Numbers written into pictures, to be read back from video frames: eight squares in the bottom left corner.

const BITS = 8;
/** Side of a square, pixels: 4:2:0 video and its filters leave its middle alone. */
const SIDE = 8;

/**
 * @param {{ width: number, height: number, rgb: Uint8Array }} picture changed
 * @param {number} number below 256
 */
export function stamp({ width, height, rgb }, number) {
  for (let y = height - SIDE; y < height; y++)
    for (let x = 0; x < BITS * SIDE; x++)
      rgb.fill((number >> Math.floor(x / SIDE)) & 1 ? 235 : 20, 3 * (y * width + x), 3 * (y * width + x) + 3);
}

/**
 * Where a page finds the squares' middles in its own copy of the picture, for {@link readStamp}.
 *
 * @param {number} height of the picture
 */
export function stampPoints(height) {
  return Array.from({ length: BITS }, (_, bit) => [bit * SIDE + SIDE / 2, height - SIDE / 2]);
}

/** @param {number[]} greys at the points, 0 to 255 */
export function readStamp(greys) {
  return greys.reduce((number, grey, bit) => number + (grey > 128 ? 2 ** bit : 0), 0);
}
