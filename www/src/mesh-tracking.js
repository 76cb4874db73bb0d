// The loop that follows the mesh through a video, with the network beside it.

import { DeepSftError } from "./error.js";
import { transferableFrame } from "./image-input.js";
import { cameraForFrame, intrinsicsOf } from "./intrinsics.js";
import { SurfaceMesh } from "./surface-mesh.js";
import { TrackedFrame } from "./tracked-frame.js";
import { VideoFrames } from "./video-frames.js";

/** @import { Estimate } from "./estimate.js" */
/** @import { CameraOption, SourcedCamera } from "./intrinsics.js" */
/** @import { TrackerStartRequest, TrackerWorker } from "./tracker.js" */

/** Least time between two frames while the template is being looked for, milliseconds. */
const SEARCHING_INTERVAL_MS = 60;

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
  #stopped = false;
  /** Whether the tracker had the template in its last frame. */
  #found = false;
  /** Whether the network looks at a frame, or the tracker at its answer, or the network rests. */
  #networkBusy = false;
  #answeredAt = Number.NaN;
  #networkFps = 0;
  /** What the last answer took, milliseconds. */
  #networkMs = 0;
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
    const { tracker, camera: cameraOption, onTracked } = this.#parts;
    const topology = await this.#ready;
    let followedAt = -Infinity;
    let timeS = 0;
    for (let number = 1; ; ) {
      const shownAt = await this.#frames.next();
      if (shownAt === null) return;
      const began = performance.now();
      // The tracker keeps some thirty frames: those between a question to the network and its answer must be among them.
      if (!this.#found && began - followedAt < Math.max(SEARCHING_INTERVAL_MS, this.#networkMs / 16)) continue;
      followedAt = began;
      const grabbed = await transferableFrame(video);
      const grabMs = performance.now() - began;
      const { frame } = grabbed;
      if (this.#stopped) return closeFrame(frame);
      const camera = cameraForFrame(cameraOption, grabbed);
      // Two frames of one time would start the track afresh.
      timeS = Math.max(shownAt / 1000, timeS + 1e-3);
      if (!this.#networkBusy && frame instanceof ImageBitmap)
        void this.#ask(number, await createImageBitmap(frame), camera);
      const request = { number, timeS, frame, intrinsics: intrinsicsOf(camera) };
      const raw = await tracker.follow(request);
      if (this.#stopped) return raw.bitmap?.close();
      const { agreement, iterations, times, readMs, bitmap } = raw;
      this.#found = raw.found;
      onTracked(
        new TrackedFrame({
          number,
          mesh: raw.found ? new SurfaceMesh(raw, topology, "tracking") : null,
          agreement,
          iterations,
          camera,
          times: { captureMs: grabMs + readMs, ...times, totalMs: performance.now() - began },
          networkFps: this.#networkFps,
          frame: bitmap,
        }),
      );
      number++;
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
    this.#frames.takeMissed();
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
      if (this.#found && this.#frames.takeMissed() > 0) await pause(performance.now() - began);
      this.#networkBusy = false;
    } catch (error) {
      this.#fail(error);
    }
  }
}

/** @param {ImageBitmap | ImageData} frame */
function closeFrame(frame) {
  if (frame instanceof ImageBitmap) frame.close();
}

/** @param {number} ms */
function pause(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
