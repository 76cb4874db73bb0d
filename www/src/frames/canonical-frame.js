// The canonical image of a frame, made by the browser.

import { CANONICAL_FOCAL, canonicalSize, imageFromCanonical } from "../camera/canonical.js";
import { isPinhole } from "../camera/lens.js";

/** @import { SourcedCamera } from "../camera/intrinsics.js" */

/**
 * The numbers of the canonical camera that stands for a camera, in the order the engine takes them.
 *
 * @param {{ width: number, height: number }} camera
 * @param {number} [focal] of the canonical image, pixels
 */
export function canonicalIntrinsics(camera, focal = CANONICAL_FOCAL) {
  const { width, height } = canonicalSize(camera);
  return [focal, focal, width / 2, height / 2, 0, 0, 0, 0, 0];
}

/**
 * Frame pixels a canonical pixel up to which one interpolated sample, of four pixels, skips none; it costs a fifth of what browsers
 * do beyond: they halve the picture first.
 */
const MAX_INTERPOLATED = 2.1;

/** Frame pixels a canonical pixel from which a frame on its way to pixels is halved first: nearer to two that blurs. */
const MIN_HALVED = 2.5;

/** Frame pixels a canonical pixel below which little is spared: the engine's own warp then stays, to the bit. */
const MIN_SCALE = 1.25;

/** For bitmaps, and for pixels. @type {(OffscreenCanvasRenderingContext2D | null)[]} */
const contexts = [];

/** Frames of half the width and height, on their way to pixels. @type {OffscreenCanvasRenderingContext2D | null} */
let half = null;

/**
 * The canonical image of a frame whose lens does not distort: a crop and a scale, black beyond the frame. It stands for the
 * frame wherever only the canonical image is looked at, with a quarter of the pixels of 960 x 540.
 *
 * Each pixel is the mean of about those that it covers, as in the engine's own warp (`deepsft-geometry`: `camera/canonical.rs`),
 * but not to the bit: browsers halve large pictures and interpolate what is left.
 *
 * @param {ImageBitmap} frame
 * @param {SourcedCamera} camera of the frame
 * @param {boolean} [asPixels] whether it is read at once, which costs least where the browser draws with the processor
 * @param {number} [focal] of the canonical image, pixels
 * @returns {ImageBitmap | ImageData | null} null where the engine's warp is needed, for the lens distorts, or the frame is hardly larger
 */
export function canonicalFrame(frame, camera, asPixels = false, focal = CANONICAL_FOCAL) {
  if (!isPinhole(camera)) return null;
  const [left, top] = imageFromCanonical(camera, 0, 0, focal);
  const { width, height } = canonicalSize(camera);
  const [right, bottom] = imageFromCanonical(camera, width, height, focal);
  const scale = Math.max((right - left) / width, (bottom - top) / height);
  if (scale < MIN_SCALE) return null;
  const settings = { alpha: false, willReadFrequently: asPixels };
  const context = (contexts[Number(asPixels)] ??= new OffscreenCanvas(width, height).getContext("2d", settings));
  if (!context) return null;
  if (context.canvas.width !== width) Object.assign(context.canvas, { width, height });
  const halved = asPixels && scale >= MIN_HALVED ? halfOf(frame) : null;
  const by = halved ? 0.5 : 1;
  const part = /** @type {const} */ ([by * left, by * top, by * (right - left), by * (bottom - top)]);
  context.imageSmoothingQuality = by * scale <= MAX_INTERPOLATED ? "low" : "medium";
  context.drawImage(halved ?? frame, ...part, 0, 0, width, height);
  if (!asPixels) return context.canvas.transferToImageBitmap();
  const pixels = context.getImageData(0, 0, width, height);
  // Black for the next frame, as the other way leaves it.
  context.clearRect(0, 0, width, height);
  return pixels;
}

/**
 * The frame with half the width and height, each pixel the mean of four. Where the processor draws, this with one more step takes two
 * thirds of the time that the browser takes to do the same by itself.
 *
 * @param {ImageBitmap} frame
 */
function halfOf(frame) {
  const [width, height] = [frame.width >> 1, frame.height >> 1];
  if (half?.canvas.width !== width || half.canvas.height !== height)
    half = new OffscreenCanvas(width, height).getContext("2d", { alpha: false, willReadFrequently: true });
  if (!half) return null;
  half.imageSmoothingQuality = "low";
  half.drawImage(frame, 0, 0, 2 * width, 2 * height, 0, 0, width, height);
  return half.canvas;
}
