// New frames of a video, the newest of them each time.

/** Tells when a video shows a frame that was not taken yet. */
export class VideoFrames {
  #video;
  #stopped = false;
  /** Clock time of the newest frame, ms, while it is untaken. @type {number | null} */
  #shownAt = null;
  /** @type {() => void} */
  #wake = () => undefined;
  /** How often the video has come to play something else: another camera, another file. */
  changes = 0;
  /** When a frame last went by untaken, ms. */
  missedAt = -Infinity;
  #onEmptied = () => {
    this.changes++;
    this.#shownAt = null;
  };

  /** @param {HTMLVideoElement} video */
  constructor(video) {
    this.#video = video;
    video.addEventListener("emptied", this.#onEmptied);
    this.#listen();
  }

  /**
   * Waits for a frame that was not taken yet; at once when one is there.
   *
   * @returns {Promise<number | null>} when it was shown, milliseconds of the page's clock, ascending; null once stopped
   */
  async next() {
    while (this.#shownAt === null && !this.#stopped)
      await new Promise((resolve) => (this.#wake = /** @type {() => void} */ (resolve)));
    const shownAt = this.#shownAt;
    this.#shownAt = null;
    return this.#stopped ? null : shownAt;
  }

  /** Whether there is a frame that was not taken yet. */
  get waiting() {
    return this.#shownAt !== null;
  }

  stop() {
    this.#stopped = true;
    this.#video.removeEventListener("emptied", this.#onEmptied);
    this.#wake();
  }

  #listen() {
    if (this.#stopped) return;
    const shown = (/** @type {number} */ at) => {
      if (this.#shownAt !== null) this.missedAt = at;
      this.#shownAt = at;
      this.#wake();
      this.#listen();
    };
    // Media time would jump back when a clip starts over.
    if ("requestVideoFrameCallback" in this.#video)
      this.#video.requestVideoFrameCallback((_, { presentationTime }) => shown(presentationTime));
    else requestAnimationFrame(shown);
  }
}
