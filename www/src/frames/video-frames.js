// New frames of a video, the newest of them each time.

import { transferableFrame } from "./image-input.js";
import { MemoryFrames } from "./memory-frames.js";

/**
 * Why a source gives no frames: the video is paused, has ended, has no picture yet (`waiting`, also for frames of one's own), or is not
 * displayed (`hidden`), where some browsers stop it.
 *
 * @typedef {"paused" | "ended" | "waiting" | "hidden" | "unknown"} StallReason
 */

/** After so long without a word from the browser it is looked whether the picture changes all the same, milliseconds. */
const SILENT_MS = 1000;

/** Tells when a video shows a frame that was not taken yet. */
export class VideoFrames {
  #video;
  #signal;
  #memory;
  /** Clock time of the newest frame, ms, while it is untaken. @type {number | null} */
  #shownAt = null;
  /** When a frame last came, and when the browser last told of one, ms. */
  #heardAt = performance.now();
  #toldAt = performance.now();
  /** Whether it is looked for new pictures. */
  #polls = false;
  /** @type {() => void} */
  #wake = () => undefined;
  /** How often the video has come to play something else: another camera, another file. */
  changes = 0;
  /** When a frame last went by untaken, ms. */
  missedAt = -Infinity;
  /** Whether frames that come too soon wait, and are not left out. */
  isPatient = false;

  /**
   * @param {HTMLVideoElement} video
   * @param {AbortSignal} signal stops it
   * @param {boolean} [software] whether its frames are read from memory where they lie there
   */
  constructor(video, signal, software = false) {
    this.#video = video;
    this.#signal = signal;
    this.#memory = software ? new MemoryFrames() : null;
    const emptied = () => {
      this.changes++;
      this.#shownAt = null;
    };
    video.addEventListener("emptied", emptied, { signal });
    signal.addEventListener("abort", () => this.#wake());
    this.#listen();
  }

  /**
   * Waits for a frame that was not taken yet; at once when one is there.
   *
   * @returns {Promise<number | null>} when it was shown, milliseconds of the page's clock, ascending; null once stopped
   */
  async next() {
    while (this.#shownAt === null && !this.#signal.aborted)
      await new Promise((resolve) => (this.#wake = /** @type {() => void} */ (resolve)));
    const shownAt = this.#shownAt;
    this.#shownAt = null;
    return this.#signal.aborted ? null : shownAt;
  }

  /**
   * What the video shows now.
   *
   * @returns {Promise<{ frame: ImageBitmap, width: number, height: number }>}
   * @throws {import("../error.js").DeepSftError} `image-unreadable`, `image-cross-origin`
   */
  async grab() {
    const inMemory = await this.#memory?.grab(this.#video);
    // Of videos only bitmaps are made.
    return inMemory ?? /** @type {Promise<{ frame: ImageBitmap, width: number, height: number }>} */ (transferableFrame(this.#video));
  }

  /** Whether there is a frame that was not taken yet. */
  get waiting() {
    return this.#shownAt !== null;
  }

  /** So long no frame came, milliseconds; to be asked now and then, for it also looks whether the browser only fails to tell. */
  get silentMs() {
    if (performance.now() - this.#toldAt > SILENT_MS && !this.#polls) this.#poll(this.#picture);
    return performance.now() - this.#heardAt;
  }

  /** Why. @returns {StallReason} */
  get silence() {
    const { paused, ended, readyState, HAVE_CURRENT_DATA } = this.#video;
    if (ended) return "ended";
    if (paused) return "paused";
    if (readyState < HAVE_CURRENT_DATA) return "waiting";
    return this.#video.getClientRects().length === 0 ? "hidden" : "unknown";
  }

  /** @param {number} at */
  #shown(at) {
    if (this.#shownAt !== null) this.missedAt = at;
    this.#shownAt = at;
    this.#heardAt = performance.now();
    this.#wake();
  }

  #listen() {
    if (this.#signal.aborted) return;
    if (!("requestVideoFrameCallback" in this.#video)) return this.#poll();
    // Media time would jump back when a clip starts over.
    this.#video.requestVideoFrameCallback((_, { presentationTime }) => {
      this.#toldAt = performance.now();
      this.#polls = false;
      this.#shown(presentationTime);
      this.#listen();
    });
  }

  /** Tells pictures apart; of streams some browsers count no frames. Null while there is none. */
  get #picture() {
    const { readyState, HAVE_CURRENT_DATA, currentTime } = this.#video;
    return readyState < HAVE_CURRENT_DATA ? null : this.#video.getVideoPlaybackQuality?.().totalVideoFrames || currentTime;
  }

  /**
   * Looks with each frame of the screen whether the video's is another, while the browser does not tell.
   *
   * @param {number | null} [seen] the picture that was seen last
   */
  #poll(seen = null) {
    this.#polls = true;
    requestAnimationFrame((at) => {
      if (this.#signal.aborted || !this.#polls) return;
      const picture = this.#picture;
      if (picture !== null && picture !== seen) this.#shown(at);
      this.#poll(picture ?? seen);
    });
  }
}
