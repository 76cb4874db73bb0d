// When a target counts as found, and when as lost.

/** Correlation of image and visible print from which a frame counts. */
const CONFIRMED = 0.35;
/** Frames in a row that must confirm a new mesh before it counts as found; from `STRONG` on one is enough. */
const FRAMES = 3;
const STRONG = 0.8;
/** A target is lost when no frame has confirmed it for so long, milliseconds: a hand that passes does not end it. */
const LOST_MS = 400;

/**
 * Found and lost with hysteresis, so that neither flickers. A target is found when three frames in a row confirm its mesh, each
 * with a correlation of 0.35 or more, or at once when one does with 0.8 or more. It is lost when no frame has
 * confirmed it for 0.4 seconds of the video.
 */
export class Presence {
  #isFound = false;
  #inARow = 0;
  #confirmedAt = -Infinity;

  get isFound() {
    return this.#isFound;
  }

  /** Whether the newest frame confirms the mesh. */
  get isConfirmed() {
    return this.#inARow > 0;
  }

  /**
   * @param {number} correlation of the newest frame with the tracker's mesh, 0 to 1; 0 without a mesh
   * @param {number} atMs time of the frame, milliseconds, ascending
   * @returns {"found" | "lost" | null} what has changed
   */
  update(correlation, atMs) {
    if (correlation >= CONFIRMED) {
      this.#inARow++;
      this.#confirmedAt = atMs;
      if (this.#isFound || !(correlation >= STRONG || this.#inARow >= FRAMES)) return null;
      this.#isFound = true;
      return "found";
    }
    this.#inARow = 0;
    if (!this.#isFound || atMs - this.#confirmedAt < LOST_MS) return null;
    this.#isFound = false;
    return "lost";
  }
}
