// A frame's pixels, few enough to be read each time.

/** Pixels along its long side: folds of a sheet are wider than one, its print is narrower. */
const LENGTH = 160;

/** @type {OffscreenCanvasRenderingContext2D | null} */
let context = null;
/** Several sheets may ask for one frame. @type {{ of: ImageBitmap, pixels: ImageData } | null} */
let newest = null;

/**
 * @param {ImageBitmap} frame
 * @returns {ImageData} of its shape, at most 160 pixels long
 */
export function smallPixels(frame) {
  if (newest?.of === frame) return newest.pixels;
  context ??= new OffscreenCanvas(1, 1).getContext("2d", { alpha: false, willReadFrequently: true });
  if (!context) throw new Error("This browser offers no canvas to read a frame with.");
  const scale = Math.min(1, LENGTH / Math.max(frame.width, frame.height));
  const [width, height] = [Math.ceil(frame.width * scale), Math.ceil(frame.height * scale)];
  const { canvas } = context;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  // Each pixel the mean of those it stands for, or nearly.
  context.imageSmoothingQuality = "medium";
  context.drawImage(frame, 0, 0, width, height);
  newest = { of: frame, pixels: context.getImageData(0, 0, width, height) };
  return newest.pixels;
}
