// The loop that follows meshes through a video, with the finders beside it. What it does when the tracker's session decides
// (`deepsft`: `session/`); here frames, questions and answers are carried between page and workers.

import { DeepSftError } from "../error.js";
import { CANONICAL_FOCAL } from "../camera/canonical.js";
import { canonicalFrame, canonicalIntrinsics } from "../frames/canonical-frame.js";
import { closeFrame, transferableFrame } from "../frames/image-input.js";
import { MemoryFrames } from "../frames/memory-frames.js";
import { Patience } from "../frames/patience.js";
import { cameraForFrame, intrinsicsOf } from "../camera/intrinsics.js";
import { SurfaceMesh } from "../results/surface-mesh.js";
import { TrackedFrame, TrackedTarget } from "../results/tracked-frame.js";
import { VideoFrames } from "../frames/video-frames.js";

/** @import { RawAnswer } from "../engine/engine-worker.js" */
/** @import { Estimate } from "../results/estimate.js" */
/** @import { CameraOption, SourcedCamera } from "../camera/intrinsics.js" */
/** @import { Target } from "../targets/target.js" */
/** @import { LastingTracker, ToldFrame } from "./lasting-tracker.js" */
/** @import { FinderQuestion, NextFrame, TrackerStartRequest } from "./tracker-worker.js" */

/**
 * A focal length that was found from a sheet that bends: of images of `width` x `height` pixels, with its standard deviation
 * (`spread`), all in pixels.
 *
 * @typedef {{ width: number, height: number, focal: number, spread: number }} FoundFocal
 */

/**
 * @typedef {object} MeshTrackingParts
 * @property {Target[]} targets
 * @property {LastingTracker} tracker ended with the loop
 * @property {TrackerStartRequest} start
 * @property {(question: Question) => Promise<{ answers: RawAnswer[], estimate: Estimate | null }>} find
 * @property {CameraOption | undefined} camera
 * @property {boolean} software whether the browser draws with the processor
 * @property {(tracked: TrackedFrame) => void} onTracked
 * @property {(target: Target, tracked: TrackedFrame) => void} [onFound]
 * @property {(target: Target, tracked: TrackedFrame) => void} [onLost]
 * @property {(estimate: Estimate, frame: number) => void} [onEstimate]
 * @property {(focal: FoundFocal) => void} [onFocal]
 */

/**
 * What the finders are asked.
 *
 * @typedef {object} Question
 * @property {number[]} ids of the targets to look for
 * @property {ImageBitmap} frame closed with the estimate, or when there is none
 * @property {ImageBitmap | null} canonical the canonical image where it is enough; closed with the answer
 * @property {SourcedCamera} camera of the frame
 * @property {number} focal of the canonical image that is looked at, pixels
 */

/** Meshes being followed through a video. */
export class MeshTracking {
  #parts;
  #frames;
  #patience = new Patience();
  /** @type {MemoryFrames | null} */
  #memory;
  #stopped = false;
  /** By number. @type {Map<number, Target>} */
  #followed;
  /** What the next frame is for. @type {NextFrame} */
  #next;
  /** When the finders last answered, milliseconds. */
  #answeredAt = Number.NaN;
  #networkFps = 0;
  /** The camera of the last frame, as text. */
  #camera = "";
  /** The first frame of those that this camera has taken as it is held now. */
  #viewBegan = 0;
  /** How often the video had come to play something else when its last frame was taken. */
  #changes = 0;
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
    this.#memory = parts.software ? new MemoryFrames() : null;
    this.#followed = new Map(parts.targets.map((target) => [target.id, target]));
    // The finders look at the first frame while the tracker starts, which then follows it.
    this.#next = { focal: CANONICAL_FOCAL, intervalMs: 0, question: { ids: [...this.#followed.keys()], onlyConfirms: false } };
    this.#ready = parts.tracker.start(parts.start);
    // Also where no frame comes that would wait for it.
    this.#ready.catch((error) => this.#fail(error));
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
   * Depth and registration of a target's mesh in the newest frame, as in an `Estimate`: rows of `width` columns, -1 where the mesh is
   * not seen, and the focal length of the canonical image that they belong to. Rejects once stopped.
   *
   * @param {Target} [target] the first when absent
   * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
   * @throws {DeepSftError} `target-unknown`, `closed`
   */
  async maps(target) {
    const [{ id } = { id: -1 }] = target ? [target] : this.#followed.values();
    await this.#ready;
    return this.#parts.tracker.maps({ id });
  }

  /**
   * Follows a target no longer. `onLost` is not called for it.
   *
   * @param {Target} target one that is not followed is left alone
   */
  unfollow({ id }) {
    if (!this.#followed.delete(id)) return;
    void this.#ready.then(() => this.#parts.tracker.unfollow({ id })).catch(() => undefined);
    if (this.#followed.size === 0) this.stop();
  }

  /** @param {HTMLVideoElement} video */
  async #loop(video) {
    /** @type {Following | null} */
    let next = null;
    for (;;) {
      const current = next ?? (await this.#begin(video));
      if (!current) return;
      const raw = await current.answer;
      if (this.#stopped) return current.frame.close();
      this.#next = raw.next;
      const { number, frame, camera, began, grabMs } = current;
      // Estimates of frames before are of another camera, or of this one as it was held.
      if (raw.afresh) this.#viewBegan = number;
      const { times, readMs } = raw;
      const totalMs = performance.now() - began;
      // Some may have been removed meanwhile.
      const seen = raw.targets.flatMap((one) => {
        const target = this.#followed.get(one.id);
        if (!target) return [];
        const mesh = one.surface ? new SurfaceMesh(one.surface, target.mesh, "tracking") : null;
        return [{ changed: one.changed, tracked: new TrackedTarget({ ...one, target, mesh }) }];
      });
      // Where a frame waits already, the worker follows it while the page draws this one.
      next = this.#frames.waiting ? await this.#begin(video, true) : null;
      if (this.#stopped) return frame.close();
      const tracked = new TrackedFrame({
        number,
        targets: seen.map(({ tracked }) => tracked),
        camera,
        times: { captureMs: grabMs + readMs, ...times, totalMs },
        networkFps: this.#networkFps,
        frame,
      });
      const { onFound, onLost, onTracked } = this.#parts;
      for (const { changed, tracked: { target, found } } of seen) if (changed) (found ? onFound : onLost)?.(target, tracked);
      onTracked(tracked);
      if (raw.focal) this.#tellFocal(current, raw.focal);
    }
  }

  /**
   * How sure the focal length of a camera is, as the tracker takes it.
   *
   * @param {SourcedCamera} camera
   */
  #focalDeviation({ source, spread, fx }) {
    if (!this.#parts.onFocal) return 0;
    if (source === "estimated") return (spread ?? Infinity) / fx;
    return source === "calibrated" ? (spread ?? 0) / fx : 0;
  }

  /**
   * @param {Following} following
   * @param {{ ratio: number, deviation: number }} found
   */
  #tellFocal({ camera, size: { width, height } }, { ratio, deviation }) {
    // The camera may have changed, or been forgotten, since.
    if (JSON.stringify(camera) !== this.#camera) return;
    const focal = (ratio * camera.fx * width) / camera.width;
    this.#parts.onFocal?.({ width, height, focal, spread: deviation * focal });
  }

  /**
   * Waits for a frame that is worth it, and has the tracker follow it.
   *
   * @param {HTMLVideoElement} video
   * @param {boolean} [waitsNot] whether only the frame that waits is tried: the one before it must not be held back for another,
   *   which may never come
   * @returns {Promise<Following | null>} null once stopped, and where that frame is not worth it
   */
  async #begin(video, waitsNot = false) {
    for (let tries = 0; tries === 0 || !waitsNot; tries++) {
      const shownAt = await this.#frames.next();
      if (shownAt === null) return null;
      const began = performance.now();
      if (began - this.#followedAt < this.#next.intervalMs) continue;
      this.#followedAt = began;
      const { changes } = this.#frames;
      const inMemory = await this.#memory?.grab(video);
      const grabbed = inMemory ?? (await transferableFrame(video).catch((error) => this.#patience.bear(error)));
      if (!grabbed) continue;
      this.#patience.reset();
      if (this.#stopped) {
        closeFrame(grabbed.frame);
        return null;
      }
      const camera = this.#cameraOf(grabbed);
      // Of videos only bitmaps are made.
      const frame = /** @type {ImageBitmap} */ (grabbed.frame);
      // What was said of the next frame was said of the camera of the one before.
      const of = JSON.stringify(camera);
      const focal = of === this.#camera ? this.#next.focal : CANONICAL_FOCAL;
      this.#camera = of;
      const canonical = canonicalFrame(frame, camera, this.#memory !== null, focal);
      const grabMs = performance.now() - began;
      const afresh = changes !== this.#changes;
      this.#changes = changes;
      this.#timeS = Math.max(shownAt / 1000, this.#timeS + 1e-3);
      const number = ++this.#number;
      const question = this.#takeQuestion();
      const small = canonical && question?.onlyConfirms ? createImageBitmap(canonical) : null;
      const copies = question && (await Promise.all([createImageBitmap(frame), small]));
      // The frame itself stays here, to be drawn.
      const looked = canonical ?? (await createImageBitmap(frame));
      const intrinsics = canonical ? canonicalIntrinsics(camera, focal) : intrinsicsOf(camera);
      const { width, height } = grabbed;
      const source = [camera.width, camera.height, ...intrinsicsOf(camera)];
      const focalDeviation = this.#focalDeviation(camera);
      const answer = this.#parts.tracker.follow(
        { timeS: this.#timeS, afresh, frame: looked, intrinsics, source, focalDeviation, focal, question },
      );
      // Should a callback throw before it is waited for, nobody waits for it any more.
      answer.catch(() => frame.close());
      // The tracker has to know of the question before it hears the answer.
      if (question && copies) void this.#ask(number, { ids: question.ids, frame: copies[0], canonical: copies[1], camera, focal });
      return { number, frame, camera, size: { width, height }, began, grabMs, answer };
    }
    return null;
  }

  /**
   * The question for the finders, which is asked once; null when there is none.
   *
   * @returns {FinderQuestion | null}
   */
  #takeQuestion() {
    const { question } = this.#next;
    if (!question) return null;
    this.#next = { ...this.#next, question: null };
    const ids = question.ids.filter((id) => this.#followed.has(id));
    return ids.length > 0 ? { ...question, ids } : null;
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
   * Has the finders look at a frame and the tracker hear of it.
   *
   * @param {number} number of the frame
   * @param {Question} question
   */
  async #ask(number, question) {
    const { tracker, find, onEstimate } = this.#parts;
    if (this.#stopped) {
      question.canonical?.close();
      return question.frame.close();
    }
    const began = performance.now();
    try {
      const { answers, estimate } = await find(question);
      if (this.#stopped) return estimate?.close();
      const now = performance.now();
      if (Number.isFinite(this.#answeredAt)) this.#networkFps = 1000 / (now - this.#answeredAt);
      this.#answeredAt = now;
      const heard = tracker.answer({ answers, tookMs: now - began, sinceMissedMs: now - this.#frames.missedAt });
      // Should the callback throw, nobody waits for this any more.
      heard.catch(() => undefined);
      if (estimate && number < this.#viewBegan) estimate.close();
      else if (estimate) onEstimate?.(estimate, number);
      const { next } = await heard;
      if (next) this.#next = next;
    } catch (error) {
      this.#fail(error);
    }
  }
}

/**
 * A frame that the tracker is following.
 *
 * @typedef {object} Following
 * @property {number} number
 * @property {ImageBitmap} frame
 * @property {SourcedCamera} camera
 * @property {{ width: number, height: number }} size with which the frame came, pixels
 * @property {number} began when the tracker was free for it, milliseconds
 * @property {number} grabMs
 * @property {Promise<ToldFrame>} answer
 */
