// The loop that follows meshes through a video, with the finders beside it.

import { DeepSftError } from "../error.js";
import { canonicalSize } from "../camera/canonical.js";
import { ViewChoice } from "../camera/canonical-views.js";
import { canonicalFrame, canonicalIntrinsics } from "../frames/canonical-frame.js";
import { closeFrame, transferableFrame } from "../frames/image-input.js";
import { MemoryFrames } from "../frames/memory-frames.js";
import { Patience } from "../frames/patience.js";
import { cameraForFrame, intrinsicsOf } from "../camera/intrinsics.js";
import { SurfaceMesh } from "../results/surface-mesh.js";
import { TrackedFrame, TrackedTarget } from "../results/tracked-frame.js";
import { VideoFrames } from "../frames/video-frames.js";
import { Presence } from "./presence.js";
import { SearchPlan } from "./search-plan.js";

/** @import { RawAnswer } from "../engine/engine-worker.js" */
/** @import { Estimate } from "../results/estimate.js" */
/** @import { CameraOption, SourcedCamera } from "../camera/intrinsics.js" */
/** @import { Target } from "../targets/target.js" */
/** @import { RawTracked, RawTrackedTarget, TrackerStartRequest, TrackerWorker } from "./tracker-worker.js" */

/** Least time between two frames while nothing is followed, milliseconds. */
const SEARCHING_INTERVAL_MS = 60;
/** The tracker keeps 32 frames; the finders may take longer than the last time. */
const KEPT_FRAMES = 24;
/** So long after a missed frame the processor counts as too slow for tracker and finders, milliseconds. */
const BUSY_MS = 2000;

/** A focal length is told of when its standard deviation is below this fraction of it, and then when it is smaller by a fifth. */
const MAX_FOCAL_DEVIATION = 0.015;
const TOLD_AGAIN = 0.8;
/** Below this the search for it, which takes as long as following every second frame, is over. */
const FOCAL_DEVIATION_SOUGHT = 0.005;

/**
 * A focal length that was found from a sheet that bends: of images of `width` x `height` pixels, with its standard deviation
 * (`spread`), all in pixels.
 *
 * @typedef {{ width: number, height: number, focal: number, spread: number }} FoundFocal
 */

/**
 * @typedef {object} MeshTrackingParts
 * @property {Target[]} targets
 * @property {TrackerWorker} tracker ended with the loop
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

/** A target that is followed, with what was last shown of it, and whether that is of the newest frame. @typedef {{ target: Target, presence: Presence, mesh: SurfaceMesh | null, isNew: boolean }} Followed */

/** Meshes being followed through a video. */
export class MeshTracking {
  #parts;
  #frames;
  #patience = new Patience();
  /** @type {MemoryFrames | null} */
  #memory;
  #stopped = false;
  /** @type {Map<number, Followed>} */
  #followed;
  /** @type {SearchPlan} */
  #plan;
  /** Whether the finders look at a frame, or the tracker at their answers, or the finders rest. */
  #findersBusy = false;
  #answeredAt = Number.NaN;
  #networkFps = 0;
  /** What the last answer took, milliseconds. */
  #findingMs = 0;
  /** Ends the finders' rest. */
  #wakeFinders = () => {};
  /** Camera of the last frame, and how sure its focal length is: the standard deviation, as a fraction. */
  #focal = { of: "", deviation: Infinity };
  #view = new ViewChoice();
  /** Columns of the canonical image of the last frame. */
  #canonicalWidth = 0;
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
    this.#followed = new Map(
      parts.targets.map((target) => [target.id, { target, presence: new Presence(), mesh: null, isNew: false }]),
    );
    this.#plan = new SearchPlan(parts.targets);
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
    this.#wakeFinders();
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
    const [{ target: { id } } = { target: { id: -1 } }] = target ? [{ target }] : this.#followed.values();
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
    this.#plan.remove(id);
    void this.#ready.then(() => this.#parts.tracker.unfollow({ id })).catch(() => undefined);
    if (this.#followed.size === 0) this.stop();
  }

  /** @param {HTMLVideoElement} video */
  async #loop(video) {
    // The finders look at the first frame while the tracker starts, which then follows it.
    /** @type {Following | null} */
    let next = null;
    for (;;) {
      const current = next ?? (await this.#begin(video));
      if (!current) return;
      const raw = await current.answer;
      if (this.#stopped) return current.frame.close();
      const lost = raw.targets.map(({ id, found, correlation }) => this.#plan.tracked(id, found, correlation));
      if (lost.includes(true)) this.#wakeFinders();
      const { number, timeS, frame, camera, began, grabMs } = current;
      if (this.#isTurned(camera) || current.afresh) this.#beginView(number);
      const { times, readMs } = raw;
      const totalMs = performance.now() - began;
      const seen = raw.targets.flatMap((one) => this.#seen(one, 1000 * timeS) ?? []);
      // Where frames wait already, the worker follows the next while the page draws this one.
      next = this.#frames.waiting ? await this.#begin(video) : null;
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
      for (const { change, tracked: { target } } of seen) {
        if (change === "found") onFound?.(target, tracked);
        if (change === "lost") onLost?.(target, tracked);
      }
      onTracked(tracked);
      if (raw.focal) this.#tellFocal(current, raw.focal);
    }
  }

  /**
   * Whether the tracker is to look for the focal length in this frame. Where the camera changes it begins anew, for what it saw until
   * then was seen through another.
   *
   * @param {SourcedCamera} camera of the frame
   */
  #seeksFocal(camera) {
    const { source, spread = Infinity, fx } = camera;
    const isSought = this.#parts.onFocal !== undefined && (source === "estimated" || source === "calibrated");
    const of = JSON.stringify(camera);
    const isSame = of === this.#focal.of;
    if (!isSame) this.#focal = { of, deviation: source === "calibrated" && spread === Infinity ? 0 : spread / fx };
    return isSought && isSame && this.#focal.deviation > FOCAL_DEVIATION_SOUGHT;
  }

  /**
   * @param {Following} following
   * @param {{ ratio: number, deviation: number }} found
   */
  #tellFocal({ camera, size: { width, height } }, { ratio, deviation }) {
    // The camera may have changed, or been forgotten, since.
    if (JSON.stringify(camera) !== this.#focal.of) return;
    if (deviation > Math.min(MAX_FOCAL_DEVIATION, TOLD_AGAIN * this.#focal.deviation)) return;
    this.#focal.deviation = deviation;
    const focal = (ratio * camera.fx * width) / camera.width;
    this.#parts.onFocal?.({ width, height, focal, spread: deviation * focal });
  }

  /** @param {SourcedCamera} camera of the frame */
  #isTurned(camera) {
    const { width } = canonicalSize(camera);
    const before = this.#canonicalWidth;
    this.#canonicalWidth = width;
    return before !== width;
  }

  /**
   * Forgets the meshes: they lie in the frame of another camera, or of this one as it was held.
   *
   * @param {number} number of the first frame that is not
   */
  #beginView(number) {
    this.#viewBegan = number;
    for (const followed of this.#followed.values()) [followed.mesh, followed.isNew] = [null, false];
  }

  /**
   * What is told of a target in a frame.
   *
   * @param {RawTrackedTarget} raw
   * @param {number} atMs
   */
  #seen(raw, atMs) {
    const followed = this.#followed.get(raw.id);
    // Removed meanwhile.
    if (!followed) return null;
    const { target, presence } = followed;
    const { found, correlation, iterations } = raw;
    const change = presence.update(found ? correlation : 0, atMs);
    if (found) followed.mesh = new SurfaceMesh(raw, target.mesh, "tracking");
    followed.isNew = found;
    const mesh = presence.isFound ? followed.mesh : null;
    const held = mesh !== null && !presence.isConfirmed;
    return { change, tracked: new TrackedTarget({ target, mesh, held, correlation, iterations }) };
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
      // Those between a question to the finders and their answer must be among the frames that the tracker keeps.
      const answerable = this.#plan.isMissingSome ? this.#findingMs / KEPT_FRAMES : 0;
      const interval = Math.max(this.#plan.isFollowingSome ? 0 : SEARCHING_INTERVAL_MS, answerable);
      if (began - this.#followedAt < interval) continue;
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
      const ids = this.#findersBusy ? [] : this.#plan.next(began);
      const meshes = [...this.#followed.values()].flatMap(({ mesh, isNew }) => (mesh && isNew ? [mesh.vertices] : []));
      const focal = this.#view.next(camera, meshes, ids.length > 0);
      const canonical = canonicalFrame(frame, camera, this.#memory !== null, focal);
      const grabMs = performance.now() - began;
      // A second frame of one time starts the tracker afresh.
      const afresh = changes !== this.#changes;
      this.#changes = changes;
      if (!afresh) this.#timeS = Math.max(shownAt / 1000, this.#timeS + 1e-3);
      else this.#focal = { of: "", deviation: Infinity };
      const number = ++this.#number;
      if (ids.length > 0) {
        const confirms = canonical && this.#plan.onlyConfirms(ids);
        const [copy, small] = await Promise.all([createImageBitmap(frame), confirms ? createImageBitmap(canonical) : null]);
        void this.#ask(number, { ids, frame: copy, canonical: small, camera, focal });
      }
      // The frame itself stays here, to be drawn.
      const looked = canonical ?? (await createImageBitmap(frame));
      const intrinsics = canonical ? canonicalIntrinsics(camera, focal) : intrinsicsOf(camera);
      const { width, height } = grabbed;
      const calibrate = !afresh && this.#seeksFocal(camera);
      const answer = this.#parts.tracker.follow({ number, timeS: this.#timeS, frame: looked, intrinsics, focal, calibrate });
      // Should a callback throw before it is waited for, nobody waits for it any more.
      answer.catch(() => frame.close());
      return { number, timeS: this.#timeS, afresh, frame, camera, size: { width, height }, began, grabMs, answer };
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
    this.#findersBusy = true;
    const began = performance.now();
    try {
      const { answers, estimate } = await find(question);
      if (this.#stopped) return estimate?.close();
      const now = performance.now();
      this.#findingMs = now - began;
      this.#plan.took(question.ids, now - began, question.canonical !== null);
      if (Number.isFinite(this.#answeredAt)) this.#networkFps = 1000 / (now - this.#answeredAt);
      this.#answeredAt = now;
      if (answers.some(({ sightings }) => sightings.length > 0)) this.#view.seen();
      const isFollowed = (/** @type {RawAnswer} */ { id }) => this.#followed.has(id);
      const heard = Promise.all(answers.filter(isFollowed).map((answer) => tracker.answer({ ...answer, number })));
      // Should the callback throw, nobody waits for this any more.
      heard.catch(() => undefined);
      if (estimate && number < this.#viewBegan) estimate.close();
      else if (estimate) onEstimate?.(estimate, number);
      await heard;
      const heardAt = performance.now();
      const restMs = this.#plan.restMs(heardAt - began, heardAt - this.#frames.missedAt < BUSY_MS);
      if (restMs > 0) await this.#rest(restMs);
      this.#findersBusy = false;
    } catch (error) {
      this.#fail(error);
    }
  }

  /**
   * Lets the tracker have the processor, until it loses a target.
   *
   * @param {number} ms
   */
  #rest(ms) {
    return new Promise((resolve) => {
      this.#wakeFinders = () => resolve(undefined);
      setTimeout(resolve, ms);
    });
  }
}

/**
 * A frame that the tracker is following.
 *
 * @typedef {object} Following
 * @property {number} number
 * @property {number} timeS
 * @property {boolean} afresh whether another camera or another file has begun with it
 * @property {ImageBitmap} frame
 * @property {SourcedCamera} camera
 * @property {{ width: number, height: number }} size with which the frame came, pixels
 * @property {number} began when the tracker was free for it, milliseconds
 * @property {number} grabMs
 * @property {Promise<RawTracked>} answer
 */
