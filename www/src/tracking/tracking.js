// The loop that follows a video.

import { Patience } from "../frames/patience.js";
import { VideoFrames } from "../frames/video-frames.js";

/** @import { Estimate } from "../results/estimate.js" */

/** A running loop over a video's frames. */
export class Tracking {
  #frames;
  #stopped = false;
  #patience = new Patience();

  /**
   * @param {HTMLVideoElement} video
   * @param {() => Promise<Estimate | null>} estimate of the frame the video shows now
   * @param {(estimate: Estimate) => void} onEstimate
   */
  constructor(video, estimate, onEstimate) {
    this.#frames = new VideoFrames(video);
    /**
     * Resolves when the loop was stopped; rejects with what ended it otherwise, an error of the estimator or one that
     * the callback threw.
     *
     * @type {Promise<void>}
     */
    this.finished = this.#loop(estimate, onEstimate).finally(() => this.stop());
  }

  /** Ends the loop; the callback is not called again. */
  stop() {
    this.#stopped = true;
    this.#frames.stop();
  }

  /**
   * @param {() => Promise<Estimate | null>} estimate
   * @param {(estimate: Estimate) => void} onEstimate
   */
  async #loop(estimate, onEstimate) {
    while ((await this.#frames.next()) !== null) {
      const result = await estimate().then(
        (answer) => (this.#patience.reset(), answer),
        (error) => {
          // Errors after stop(), such as "closed", are its consequence.
          if (!this.#stopped) this.#patience.bear(error);
          return null;
        },
      );
      if (this.#stopped) result?.close();
      else if (result) onEstimate(result);
    }
  }
}
