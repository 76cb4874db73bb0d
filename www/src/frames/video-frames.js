// New frames of a video, the newest of them each time.

/** Tells when a video shows a frame that was not taken yet. */
export class VideoFrames {
  #video;
  #stopped = false;
  /** Clock time of the newest frame, ms, while it is untaken. @type {number | null} */
  #shownAt = null;
  /** Which picture of the video was seen last, where it is looked for. */
  #polled = Number.NaN;
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
    else this.#poll(shown);
  }

  /**
   * Looks with each frame of the screen whether the video's is another, for browsers that do not tell.
   *
   * @param {(at: number) => void} shown
   */
  #poll(shown) {
    requestAnimationFrame((at) => {
      if (this.#stopped) return;
      const { readyState, HAVE_CURRENT_DATA, currentTime } = this.#video;
      // Of streams some browsers count no frames.
      const picture = this.#video.getVideoPlaybackQuality?.().totalVideoFrames || currentTime;
      if (readyState < HAVE_CURRENT_DATA || picture === this.#polled) return this.#poll(shown);
      this.#polled = picture;
      shown(at);
    });
  }
}
