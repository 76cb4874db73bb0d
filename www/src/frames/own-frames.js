// Frames that a page has by itself: of WebCodecs, of a canvas, of a file.

import { DeepSftError } from "../error.js";
import { transferableFrame } from "./image-input.js";

/**
 * A frame of one's own. It is copied before the next one is asked for, and closing it stays with who made it. Times ascend.
 *
 * @typedef {{ frame: VideoFrame | ImageBitmap | HTMLCanvasElement | OffscreenCanvas, timeMs: number }} OwnFrame
 */

/** Gives the frames of an iterable, every one of them. */
export class OwnFrames {
  #iterator;
  /** @type {OwnFrame | null} */
  #newest = null;
  /** Since when the next one is waited for, ms. */
  #since = Infinity;
  #stopped;
  /** As of a video, which may come to play something else, and whose frames may wait or go by untaken. */
  changes = 0;
  waiting = false;
  missedAt = -Infinity;
  /** Whether frames that come too soon wait, and are not left out. */
  isPatient = true;

  /**
   * @param {AsyncIterable<OwnFrame>} source
   * @param {AbortSignal} signal stops it
   */
  constructor(source, signal) {
    this.#iterator = source[Symbol.asyncIterator]();
    this.#stopped = new Promise((resolve) => signal.addEventListener("abort", () => resolve(null)));
    // It may be at work on the next frame.
    signal.addEventListener("abort", () => void Promise.resolve(this.#iterator.return?.()).catch(() => undefined));
  }

  /**
   * @returns {Promise<number | null>} time of the next frame, milliseconds; null once stopped, and after the last one
   * @throws {DeepSftError} `image-unreadable`
   */
  async next() {
    this.#since = performance.now();
    const next = await Promise.race([this.#stopped, this.#iterator.next()]).catch((cause) => {
      throw new DeepSftError("image-unreadable", `The frames ended: ${cause instanceof Error ? cause.message : cause}`, { cause });
    });
    this.#since = Infinity;
    if (!next || next.done) return null;
    this.#newest = next.value;
    const { timeMs } = next.value;
    if (Number.isFinite(timeMs)) return timeMs;
    throw new DeepSftError("image-unreadable", `The frame's timeMs is ${timeMs}, expected a number of milliseconds.`);
  }

  /** @returns {Promise<{ frame: ImageBitmap, width: number, height: number }>} a copy of the newest frame */
  grab() {
    const { frame } = /** @type {OwnFrame} */ (this.#newest);
    return /** @type {Promise<{ frame: ImageBitmap, width: number, height: number }>} */ (transferableFrame(frame));
  }

  /** So long no frame came, milliseconds. */
  get silentMs() {
    return performance.now() - this.#since;
  }

  /** Why. @returns {import("./video-frames.js").StallReason} */
  get silence() {
    return "waiting";
  }
}
