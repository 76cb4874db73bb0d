// The loop that follows a video.

/** @import { Estimate } from "../results/estimate.js" */

/** A running loop over a video's frames. */
export class Tracking {
  #stopped = false;
  /** @type {() => void} */
  #wake = () => undefined;

  /**
   * @param {HTMLVideoElement} video
   * @param {() => Promise<Estimate | null>} estimate of the frame the video shows now
   * @param {(estimate: Estimate) => void} onEstimate
   */
  constructor(video, estimate, onEstimate) {
    /**
     * Resolves when the loop was stopped; rejects with what ended it otherwise, an error of the estimator or one that
     * the callback threw.
     *
     * @type {Promise<void>}
     */
    this.finished = this.#loop(video, estimate, onEstimate);
  }

  /** Ends the loop; the callback is not called again. */
  stop() {
    this.#stopped = true;
    this.#wake();
  }

  /**
   * @param {HTMLVideoElement} video
   * @param {() => Promise<Estimate | null>} estimate
   * @param {(estimate: Estimate) => void} onEstimate
   */
  async #loop(video, estimate, onEstimate) {
    while (!this.#stopped) {
      await this.#nextFrame(video);
      if (this.#stopped) return;
      const result = await estimate().catch((error) => {
        // Errors after stop(), such as "closed", are its consequence.
        if (this.#stopped) return null;
        throw error;
      });
      if (this.#stopped) result?.close();
      else if (result) onEstimate(result);
    }
  }

  /**
   * Resolves when the video shows a new frame, or when the loop is stopped.
   *
   * @param {HTMLVideoElement} video
   * @returns {Promise<void>}
   */
  #nextFrame(video) {
    return new Promise((resolve) => {
      this.#wake = resolve;
      if ("requestVideoFrameCallback" in video) video.requestVideoFrameCallback(() => resolve());
      else requestAnimationFrame(() => resolve());
    });
  }
}
