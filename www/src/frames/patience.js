// Videos that cannot be read for a moment.

import { asDeepSftError } from "../error.js";

/** Only when so many frames in a row cannot be read, over so many milliseconds, is the video given up. */
const MAX_FAILURES = 10;
const PATIENCE_MS = 3000;

/**
 * Bears frames of a video that cannot be read: browsers fail to grab one while a call interrupts the camera, the phone is
 * turned or a clip starts over, and the next one is fine.
 */
export class Patience {
  #failures = 0;
  #since = 0;

  /** To be called for each frame that was read. */
  reset() {
    this.#failures = 0;
  }

  /**
   * @param {unknown} error of a frame that could not be read
   * @throws {unknown} `error`, when it is not about the frame or frames have failed for too long
   */
  bear(error) {
    if (asDeepSftError(error).code !== "image-unreadable") throw error;
    if (this.#failures++ === 0) this.#since = performance.now();
    if (this.#failures > MAX_FAILURES && performance.now() - this.#since > PATIENCE_MS) throw error;
  }
}
