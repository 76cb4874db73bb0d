// The camera's frame below the stage, for machines whose processor draws: there WebGL would take longer to bring the frame onto
// the page, and the page back out of WebGL's memory, than to draw all that lies over the frame.

import { visibleRegion } from "deepsft";
import { SMALL_LENGTH } from "./frame-picture.js";

/** @import { SourcedCamera } from "deepsft" */

/** Pixels of the backdrop along its long side, and how far it is blurred. */
const BACKDROP_LENGTH = 48;
const BLUR_PX = 2;
/** Least time between two backdrops, milliseconds: they show no motion, and each has the browser put the whole window together. */
const BACKDROP_MS = 500;

export class FrameCanvas {
  #element;
  #picture;
  #backdrop;
  /** The frame, at most `SMALL_LENGTH` pixels long. */
  #small;
  #backdropAt = -Infinity;

  /** @param {HTMLElement} element with a canvas for the backdrop, and one for the frame */
  constructor(element) {
    const [backdrop, picture] = [...element.querySelectorAll("canvas")].map((canvas) => contextOf(canvas));
    this.#element = element;
    this.#backdrop = backdrop;
    this.#picture = picture;
    this.#small = contextOf(document.createElement("canvas"), true);
  }

  /**
   * Shows a frame.
   *
   * @param {ImageBitmap} frame may be closed afterwards
   * @param {SourcedCamera} camera
   */
  show(frame, camera) {
    const { width, height } = frame;
    size(this.#picture, width, height);
    this.#picture.drawImage(frame, 0, 0);
    this.#dim(camera);
    const scale = Math.min(1, SMALL_LENGTH / Math.max(width, height));
    size(this.#small, Math.ceil(width * scale), Math.ceil(height * scale));
    // Each pixel the mean of those it stands for, or nearly.
    this.#small.imageSmoothingQuality = "medium";
    this.#small.drawImage(frame, 0, 0, this.#small.canvas.width, this.#small.canvas.height);
    this.#showBackdrop(this.#small.canvas);
  }

  /** The pixels of the frame, at most `SMALL_LENGTH` of them along its long side. @returns {ImageData} */
  get pixels() {
    return this.#small.getImageData(0, 0, this.#small.canvas.width, this.#small.canvas.height);
  }

  /**
   * Lays the frame where it belongs.
   *
   * @param {SourcedCamera} camera
   * @param {{ left: number, top: number, scale: number }} view of it on the page, CSS pixels
   */
  place({ width, height }, { left, top, scale }) {
    this.#element.hidden = false;
    layOut(this.#picture.canvas, { left, top, width: width * scale, height: height * scale });
  }

  /** Shows no frame any more. */
  clear() {
    this.#element.hidden = true;
    this.#backdropAt = -Infinity;
  }

  /** Darkens what the network does not see. @param {SourcedCamera} camera */
  #dim(camera) {
    const { left, top, right, bottom } = visibleRegion(camera);
    this.#picture.fillStyle = "rgb(0 0 0 / 0.58)";
    this.#picture.beginPath();
    this.#picture.rect(0, 0, camera.width, camera.height);
    this.#picture.rect(left, top, right - left, bottom - top);
    this.#picture.fill("evenodd");
  }

  /** @param {HTMLCanvasElement} frame */
  #showBackdrop(frame) {
    const now = performance.now();
    if (now - this.#backdropAt < BACKDROP_MS) return;
    this.#backdropAt = now;
    const context = this.#backdrop;
    const scale = BACKDROP_LENGTH / Math.max(frame.width, frame.height);
    const [width, height] = [Math.ceil(frame.width * scale), Math.ceil(frame.height * scale)];
    size(context, width, height);
    context.filter = `blur(${BLUR_PX}px)`;
    // Beyond the border, where the blur would fade out.
    context.drawImage(frame, -2 * BLUR_PX, -2 * BLUR_PX, width + 4 * BLUR_PX, height + 4 * BLUR_PX);
    context.filter = "none";
    context.fillStyle = "rgb(14 16 19 / 0.78)";
    context.fillRect(0, 0, width, height);
  }
}

/**
 * Lays an element out over what it lies in, if it does not lie so already. It is moved by a transform, for which the browser lays nothing
 * else out.
 *
 * @param {HTMLElement} element
 * @param {{ left: number, top: number, width: number, height: number }} place CSS pixels
 */
export function layOut({ style }, { left, top, width, height }) {
  const place = {
    transform: `translate(${Math.round(left)}px, ${Math.round(top)}px)`,
    width: `${Math.round(width)}px`,
    height: `${Math.round(height)}px`,
  };
  for (const name of /** @type {const} */ (["transform", "width", "height"])) if (style[name] !== place[name]) style[name] = place[name];
}

/** @param {HTMLCanvasElement} canvas @param {boolean} [willReadFrequently] */
function contextOf(canvas, willReadFrequently = false) {
  const context = canvas.getContext("2d", { alpha: false, willReadFrequently });
  if (!context) throw new Error("This browser offers no canvas to draw a frame on.");
  return context;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} width
 * @param {number} height
 */
function size({ canvas }, width, height) {
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
}
