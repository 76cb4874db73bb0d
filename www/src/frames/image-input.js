// From whatever a page calls an image to pixels that can cross to the worker, and what a worker reads of them.

import { addressOf, isAddress } from "../address.js";
import { DeepSftError, crossOriginError } from "../error.js";

/** @typedef {HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob} ReadImage */

/**
 * Images that are accepted. Compressed files go in as an address, relative to the page, or as a Blob (a File is one). An `<img>` that
 * still loads is waited for.
 *
 * @typedef {ReadImage | string | URL} ImageInput
 */

/**
 * Larger images are scaled down to this: the canonical image has 0.13 megapixels, and a 400 megapixel scan
 * would take 1.6 GB to read.
 */
export const MAX_PIXELS = 16_777_216;

/** So long a video may take to jump, and so often it is looked whether it has, milliseconds. */
const MAX_SEEK_MS = 5000;
const LOOK_MS = 10;

/**
 * The image of an address, fetched; others as they are.
 *
 * @param {ImageInput} image
 * @param {AbortSignal} [signal]
 * @throws {DeepSftError} `image-unreadable`
 */
export async function readImage(image, signal) {
  signal?.throwIfAborted();
  if (!isAddress(image)) return image;
  const url = addressOf(image);
  try {
    const response = await fetch(url, { signal });
    if (response.ok) return await response.blob();
    throw new Error(`the server answered ${response.status}`);
  } catch (cause) {
    signal?.throwIfAborted();
    const reason = cause instanceof Error ? cause.message : cause;
    throw new DeepSftError("image-unreadable", `${url} could not be fetched: ${reason}.`, { cause });
  }
}

/**
 * The image as something that can be transferred, at most {@link MAX_PIXELS} large.
 *
 * @param {ReadImage} image
 * @returns {Promise<{ frame: ImageBitmap | ImageData, width: number, height: number }>} width and height: of the image before it was made smaller
 * @throws {DeepSftError} `image-unreadable`
 */
export async function transferableFrame(image) {
  if (image instanceof ImageData && image.width * image.height <= MAX_PIXELS) {
    const { data, width, height } = image;
    return { frame: new ImageData(new Uint8ClampedArray(data), width, height), width, height };
  }
  if (typeof HTMLVideoElement !== "undefined" && image instanceof HTMLVideoElement) {
    const until = performance.now() + MAX_SEEK_MS;
    while (image.readyState < image.HAVE_CURRENT_DATA) {
      // While it jumps (a clip that loops jumps to its start) a picture is on its way.
      if (!image.seeking || performance.now() > until)
        throw new DeepSftError("image-unreadable", "The video has no picture yet; wait for its loadeddata event.");
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    }
  }
  // One that is broken is refused below.
  if (typeof HTMLImageElement !== "undefined" && image instanceof HTMLImageElement) await image.decode().catch(() => undefined);
  let bitmap;
  try {
    bitmap = await createImageBitmap(image);
  } catch (error) {
    const name = image instanceof Blob && "name" in image ? image.name : "The image";
    const reason = image instanceof Blob ? await whyUnreadable(image) : "it is empty, broken or too large";
    throw new DeepSftError("image-unreadable", `${name} could not be read: ${reason}.`, { cause: error });
  }
  const { width, height } = bitmap;
  if (width * height <= MAX_PIXELS) return { frame: bitmap, width, height };
  const scale = Math.sqrt(MAX_PIXELS / (width * height));
  const [resizeWidth, resizeHeight] = [width, height].map((side) => Math.max(1, Math.floor(side * scale)));
  try {
    return { frame: await createImageBitmap(bitmap, { resizeWidth, resizeHeight, resizeQuality: "high" }), width, height };
  } catch (error) {
    throw new DeepSftError("image-unreadable", "The image is too large for this browser.", { cause: error });
  } finally {
    bitmap.close();
  }
}

/**
 * A picture as it looks on white paper, made smaller where it is larger than `longestSide`.
 *
 * @param {ImageBitmap | ImageData} frame
 * @param {number} longestSide pixels
 * @throws {DeepSftError} `internal`, `image-cross-origin`
 */
export async function opaquePixels(frame, longestSide) {
  const scale = Math.min(1, longestSide / Math.max(frame.width, frame.height));
  const [width, height] = [frame.width, frame.height].map((side) => Math.max(1, Math.round(scale * side)));
  const small = await createImageBitmap(frame, { resizeWidth: width, resizeHeight: height, resizeQuality: "high" });
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  if (!context) throw new DeepSftError("internal", "This browser offers no canvas to read a picture with.");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, width, height);
  // Its size again, for browsers that do not know the wish above.
  context.drawImage(small, 0, 0, width, height);
  small.close();
  try {
    return context.getImageData(0, 0, width, height);
  } catch (error) {
    throw crossOriginError(error);
  }
}

/** What frames are read by, in a worker. @type {OffscreenCanvas | undefined} */
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

/**
 * Decodes a picture's file, of any kind that the browser knows.
 *
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @throws {DeepSftError} `image-unreadable`, `internal`
 */
export async function decodedPixels(bytes) {
  const { frame } = await transferableFrame(new Blob([bytes]));
  return opaquePixels(frame, Infinity).finally(() => closeFrame(frame));
}

/** Kinds of pictures by their first bytes: those that every browser knows, and others that people have. */
const KNOWN = /^(\x89PNG|\xff\xd8\xff|GIF8|RIFF....WEBP|BM)/s;
const OTHERS = Object.entries({ TIFF: /^(II\*\0|MM\0\*)/, HEIC: /^....ftyp(hei|hev|mif1|msf1)/s, AVIF: /^....ftypavi/s });

/**
 * Tells why this browser cannot read a file as a picture, and what to do.
 *
 * @param {Blob} file that could not be read
 * @returns {Promise<string>} "it is ...", and what to do, without the full stop
 */
export async function whyUnreadable(file) {
  if (file.size === 0) return "it is empty (0 bytes). Copy it again from where it came";
  const start = String.fromCharCode(...new Uint8Array(await file.slice(0, 16).arrayBuffer()));
  if (KNOWN.test(start)) return "it was cut short, is broken or too large. Copy it again from where it came";
  const [kind] = OTHERS.find(([, begins]) => begins.test(start)) ?? [];
  if (kind === "HEIC") return "it is HEIC, which this browser does not know. Export it as JPEG (on an iPhone: Settings, Camera, Formats, Most Compatible)";
  return `it is ${kind ? `${kind}, which this browser does not know` : "no picture that this browser knows"}. Save it as PNG or JPEG`;
}

/**
 * Lets a frame's memory go. One that was sent to a worker has none left here.
 *
 * @param {ImageBitmap | ImageData} frame
 */
export function closeFrame(frame) {
  if (frame instanceof ImageBitmap) frame.close();
}
