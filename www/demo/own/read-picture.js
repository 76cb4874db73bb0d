// From a file or a camera's frame to pixels that can be cropped.

import { whyUnreadable } from "deepsft";
import { PictureError } from "../messages.js";

/** Longest side, pixels, that is worked with. A photograph of a print is larger than the print in it. */
const MAX_LENGTH = 3000;
/** Longest side of the flat picture that is handed over: finer detail than a camera sees at any distance. */
export const MAX_PICTURE_LENGTH = 2000;
/** Shortest side, pixels, with anything on it to be found by. */
const MIN_LENGTH = 64;

/** An opaque picture; `transparent`: parts of it were see-through, and are white now. @typedef {ReturnType<typeof pictureFrom>} OpenedPicture */

/**
 * @param {File} file
 * @throws {PictureError} `image-unreadable`, `picture-small`, `picture-empty`
 */
export async function readPicture(file) {
  const url = URL.createObjectURL(file);
  // Unlike `createImageBitmap` this takes drawings (SVG) too.
  const image = Object.assign(new Image(), { src: url });
  try {
    await image.decode();
  } catch (cause) {
    throw new PictureError("image-unreadable", `${file.name} could not be read: ${await whyUnreadable(file)}.`, { cause });
  } finally {
    URL.revokeObjectURL(url);
  }
  return pictureFrom(image, image.naturalWidth, image.naturalHeight, file.name);
}

/**
 * @param {CanvasImageSource} image
 * @param {number} width pixels
 * @param {number} height
 * @param {string} name
 */
export function pictureFrom(image, width, height, name) {
  if (Math.min(width, height) < MIN_LENGTH)
    throw new PictureError("picture-small", `${name} is ${width} × ${height} pixels.`);
  const canvas = shrunk(image, MAX_LENGTH, canvasOf(1, 1), { width, height });
  const context = contextOf(canvas);
  const opacities = opacitiesOf(canvas);
  const [least, most] = [Math.min(...opacities), Math.max(...opacities)];
  if (most === 0) throw new PictureError("picture-empty", `${name} is see-through everywhere.`);
  if (least < 255) {
    context.globalCompositeOperation = "destination-over";
    context.fillStyle = "#fff";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.globalCompositeOperation = "source-over";
  }
  return { canvas, name, transparent: least < 250 };
}

/**
 * @param {number} width
 * @param {number} height
 * @throws {PictureError} where there is no memory for it
 */
export function canvasOf(width, height) {
  return Object.assign(document.createElement("canvas"), { width, height });
}

/** @param {HTMLCanvasElement} canvas */
export function contextOf(canvas) {
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new PictureError("image-unreadable", "There is not enough memory for this picture.");
  context.imageSmoothingQuality = "high";
  return context;
}

/**
 * A picture, drawn no larger than it is.
 *
 * @param {CanvasImageSource} image
 * @param {number} longest side, pixels, at most
 * @param {HTMLCanvasElement} [canvas] that it is drawn on
 * @param {{ width: number, height: number }} [size] of the image, pixels, where it does not tell
 */
export function shrunk(image, longest, canvas = canvasOf(1, 1), { width, height } = /** @type {HTMLCanvasElement | ImageBitmap} */ (image)) {
  const scale = Math.min(1, longest / Math.max(width, height));
  [canvas.width, canvas.height] = [width, height].map((side) => Math.max(1, Math.round(side * scale)));
  contextOf(canvas).drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas;
}

/**
 * The picture, turned by a quarter clockwise.
 *
 * @param {HTMLCanvasElement} canvas
 */
export function turned(canvas) {
  const result = canvasOf(canvas.height, canvas.width);
  const context = contextOf(result);
  context.translate(result.width, 0);
  context.rotate(Math.PI / 2);
  context.drawImage(canvas, 0, 0);
  return result;
}

/**
 * Opacity of the pixels of a small copy of the picture, 0 to 255.
 *
 * @param {HTMLCanvasElement} canvas
 */
function opacitiesOf(canvas) {
  const context = contextOf(canvasOf(64, 64));
  context.drawImage(canvas, 0, 0, 64, 64);
  try {
    return context.getImageData(0, 0, 64, 64).data.filter((_, i) => i % 4 === 3);
  } catch (cause) {
    // Some browsers take what is in some drawings (SVG with parts of pages) for another site's.
    throw new PictureError("image-unreadable", "This browser does not tell what is in this picture. Save it as PNG or JPEG.", { cause });
  }
}
