// Reading a frame's pixels, in a worker.

import { DeepSftError } from "../error.js";

/** @type {OffscreenCanvas | undefined} */
let canvas;

/**
 * The pixels of a frame, sRGB, not premultiplied.
 *
 * @param {ImageBitmap | ImageData} frame
 * @returns {Uint8ClampedArray}
 * @throws {DeepSftError} `internal`
 */
export function framePixels(frame) {
  if (frame instanceof ImageData) return frame.data;
  const { width, height } = frame;
  if (canvas?.width !== width || canvas.height !== height) canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new DeepSftError("internal", "This browser offers no canvas to read a frame with.");
  context.drawImage(frame, 0, 0);
  return context.getImageData(0, 0, width, height).data;
}
