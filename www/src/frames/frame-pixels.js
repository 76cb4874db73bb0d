// Reading a frame's pixels, in a worker.

import { DeepSftError } from "../error.js";

/** @type {OffscreenCanvas | undefined} */
let canvas;

/**
 * The pixels of a frame, sRGB, not premultiplied, and how long it took to read them, milliseconds.
 *
 * @param {ImageBitmap | ImageData} frame
 * @throws {DeepSftError} `internal`
 */
export function readFrame(frame) {
  const began = performance.now();
  const { width, height } = frame;
  if (frame instanceof ImageData) return { rgba: frame.data, width, height, readMs: 0 };
  if (canvas?.width !== width || canvas.height !== height) canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new DeepSftError("internal", "This browser offers no canvas to read a frame with.");
  context.drawImage(frame, 0, 0);
  const { data: rgba } = context.getImageData(0, 0, width, height);
  return { rgba, width, height, readMs: performance.now() - began };
}
