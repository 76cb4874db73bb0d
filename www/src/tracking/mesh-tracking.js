// The loop that follows the mesh through a video, with the network beside it.

import { DeepSftError } from "../error.js";
import { closeFrame, transferableFrame } from "../frames/image-input.js";
import { Patience } from "../frames/patience.js";
import { cameraForFrame, intrinsicsOf } from "../camera/intrinsics.js";
import { SurfaceMesh } from "../results/surface-mesh.js";
import { TrackedFrame } from "../results/tracked-frame.js";
import { VideoFrames } from "../frames/video-frames.js";

/** @import { Estimate } from "../results/estimate.js" */
/** @import { CameraOption, SourcedCamera } from "../camera/intrinsics.js" */
/** @import { RawTracked, TrackerStartRequest, TrackerWorker } from "./tracker-worker.js" */

/** Least time between two frames while the template is being looked for, milliseconds. */
const SEARCHING_INTERVAL_MS = 60;
/**
 * How long the network rests after an answer where the tracker misses frames beside it, in times of that answer, and at most,
 * milliseconds.
 */
const REST = 1.5;
const MOST_REST_MS = 1000;
/** So long after a missed frame the processor counts as too slow for both, milliseconds. */
const BUSY_MS = 2000;

/**
 * @typedef {object} MeshTrackingParts
 * @property {TrackerWorker} tracker ended with the loop
 * @property {TrackerStartRequest} start
 * @property {(frame: ImageBitmap, camera: CameraOption) => Promise<Estimate>} estimate
 * @property {CameraOption | undefined} camera
 * @property {(tracked: TrackedFrame) => void} onTracked
 * @property {((estimate: Estimate, frame: number) => void) | undefined} onEstimate
 */

/** A mesh being followed through a video. */
export class MeshTracking {
  #parts;
  #frames;
  #patience = new Patience();
  #stopped = false;
  /** Whether the tracker had the template in its last frame. */
  #found = false;
  /** Whether the network looks at a frame, or the tracker at its answer, or the network rests. */
  #networkBusy = false;
  #answeredAt = Number.NaN;
  #networkFps = 0;
  /** What the last answer took, milliseconds. */
  #networkMs = 0;
  /** Ends the network's rest. */
  #wakeNetwork = () => {};
  /** Frames given to the tracker, when the last was, and its time, seconds. */
  #number = 0;
  #followedAt = -Infinity;
  #timeS = 0;
  #ready;
  /** @type {(error: unknown) => void} */
  #fail = () => undefined;

  /**
   * @param {HTMLVideoElement} video
   * @param {MeshTrackingParts} parts
   */
  constructor(video, parts) {
    this.#parts = parts;
    this.#frames = new VideoFrames(video);
    this.#ready = parts.tracker.start(parts.start);
    // The loop waits for it too, and says what went wrong.
    this.#ready.catch(() => undefined);
    const failed = new Promise((_, reject) => (this.#fail = reject));
    /**
     * Resolves when the loop was stopped; rejects with what ended it otherwise, an error of the engine or one that
     * a callback threw.
     *
     * @type {Promise<void>}
     */
    this.finished = Promise.race([this.#loop(video), failed])
      .catch((error) => {
        // Errors after stop(), such as "closed", are its consequence.
        if (!this.#stopped) throw error;
      })
      .finally(() => this.stop());
  }

  /** Ends the loop; no callback is called again. */
  stop() {
    this.#stopped = true;
    this.#wakeNetwork();
    this.#frames.stop();
    this.#parts.tracker.terminate(new DeepSftError("closed", "The tracking was stopped."));
  }

  /**
   * Depth and registration of the mesh in the newest frame, as in an `Estimate`: 270 rows of 480 columns, -1 where the
   * mesh is not seen. Rejects once stopped.
   *
   * @returns {Promise<{ depth: Float32Array, registration: Float32Array }>}
   */
  maps() {
    return this.#ready.then(() => this.#parts.tracker.maps());
  }

  /** @param {HTMLVideoElement} video */
  async #loop(video) {
    const topology = await this.#ready;
    /** @type {Following | null} */
    let next = null;
    for (;;) {
      const current = next ?? (await this.#begin(video));
      if (!current) return;
      const raw = await current.answer;
      if (this.#stopped) return raw.bitmap?.close();
      this.#found = raw.found;
      if (!raw.found) this.#wakeNetwork();
      const { number, camera, began, grabMs } = current;
      const { agreement, iterations, times, readMs, bitmap } = raw;
      const totalMs = performance.now() - began;
      // Where frames wait already, the worker follows the next while the page draws this one.
      next = this.#frames.waiting ? await this.#begin(video) : null;
      if (this.#stopped) return bitmap?.close();
      this.#parts.onTracked(
        new TrackedFrame({
          number,
          mesh: raw.found ? new SurfaceMesh(raw, topology, "tracking") : null,
          agreement,
          iterations,
          camera,
          times: { captureMs: grabMs + readMs, ...times, totalMs },
          networkFps: this.#networkFps,
          frame: bitmap,
        }),
      );
    }
  }

  /**
   * Waits for a frame and has the tracker follow it.
   *
   * @param {HTMLVideoElement} video
   * @returns {Promise<Following | null>} null once stopped
   */
  async #begin(video) {
    for (;;) {
      const shownAt = await this.#frames.next();
      if (shownAt === null) return null;
      const began = performance.now();
      // The tracker keeps some thirty frames: those between a question to the network and its answer must be among them.
      const interval = this.#found ? 0 : Math.max(SEARCHING_INTERVAL_MS, this.#networkMs / 16);
      if (began - this.#followedAt < interval) continue;
      this.#followedAt = began;
      const grabbed = await transferableFrame(video).catch((error) => this.#patience.bear(error));
      if (!grabbed) continue;
      this.#patience.reset();
      const grabMs = performance.now() - began;
      const { frame } = grabbed;
      if (this.#stopped) {
        closeFrame(frame);
        return null;
      }
      const camera = this.#cameraOf(grabbed);
      // Two frames of one time would start the track afresh.
      this.#timeS = Math.max(shownAt / 1000, this.#timeS + 1e-3);
      const number = ++this.#number;
      if (!this.#networkBusy && frame instanceof ImageBitmap)
        void this.#ask(number, await createImageBitmap(frame), camera);
      const request = { number, timeS: this.#timeS, frame, intrinsics: intrinsicsOf(camera) };
      const answer = this.#parts.tracker.follow(request);
      // Should a callback throw before it is waited for, nobody waits for it any more.
      answer.catch(() => closeFrame(frame));
      return { number, camera, began, grabMs, answer };
    }
  }

  /**
   * @param {{ frame: ImageBitmap | ImageData, width: number, height: number }} grabbed closed when its camera is refused
   * @returns {SourcedCamera}
   */
  #cameraOf(grabbed) {
    try {
      return cameraForFrame(this.#parts.camera, grabbed);
    } catch (error) {
      closeFrame(grabbed.frame);
      throw error;
    }
  }

  /**
   * Has the network look at a frame and the tracker hear of it.
   *
   * @param {number} number
   * @param {ImageBitmap} frame closed here
   * @param {SourcedCamera} camera
   */
  async #ask(number, frame, camera) {
    const { tracker, estimate, onEstimate } = this.#parts;
    if (this.#stopped) return frame.close();
    this.#networkBusy = true;
    const began = performance.now();
    try {
      const answer = await estimate(frame, camera).finally(() => frame.close());
      if (this.#stopped) return answer.close();
      const now = performance.now();
      this.#networkMs = now - began;
      if (Number.isFinite(this.#answeredAt)) this.#networkFps = 1000 / (now - this.#answeredAt);
      this.#answeredAt = now;
      const { found, depth, registration } = answer;
      const said = found
        ? { number, depth: depth.toFloat32Array(), registration: registration.toFloat32Array() }
        : { number, depth: new Float32Array(), registration: new Float32Array() };
      const heard = tracker.answer(said);
      // Should the callback throw, nobody waits for this any more.
      heard.catch(() => undefined);
      if (onEstimate) onEstimate(answer, number);
      else answer.close();
      await heard;
      // A processor with too few cores for both serves the tracker first, which misses frames otherwise; while it has the
      // template the network only confirms it.
      if (this.#found && performance.now() - this.#frames.missedAt < BUSY_MS)
        await this.#rest(Math.min(MOST_REST_MS, REST * (performance.now() - began)));
      this.#networkBusy = false;
    } catch (error) {
      this.#fail(error);
    }
  }

  /**
   * Lets the tracker have the processor, until it loses the template.
   *
   * @param {number} ms
   */
  #rest(ms) {
    return new Promise((resolve) => {
      this.#wakeNetwork = () => resolve(undefined);
      setTimeout(resolve, ms);
    });
  }
}

/**
 * A frame that the tracker is following.
 *
 * @typedef {object} Following
 * @property {number} number
 * @property {SourcedCamera} camera
 * @property {number} began when the tracker was free for it, milliseconds
 * @property {number} grabMs
 * @property {Promise<RawTracked>} answer
 */
