// The session that follows targets through a video, with the finders beside it. What it does when the tracker's session decides
// (`deepsft`: `session/`); here frames, questions and answers are carried between page and workers.

import { Announcer } from "../announcer.js";
import { DeepSftError, asDeepSftError } from "../error.js";
import { CANONICAL_FOCAL } from "../camera/canonical.js";
import { CameraStream } from "../camera/camera-stream.js";
import { canonicalFrame, canonicalIntrinsics } from "../frames/canonical-frame.js";
import { OwnFrames } from "../frames/own-frames.js";
import { Patience } from "../frames/patience.js";
import { cameraForFrame, intrinsicsOf } from "../camera/intrinsics.js";
import { scaledDepth } from "../results/estimate.js";
import { SurfaceMesh } from "../results/surface-mesh.js";
import { TrackedFrame, TrackedTarget } from "../results/tracked-frame.js";
import { VideoFrames } from "../frames/video-frames.js";
import { LastingTracker } from "./lasting-tracker.js";

/** @import { Estimate, FollowOptions, OwnFrame, Smoothing, SourcedCamera, StallReason, Target } from "../index.js" */
/** @import { RawAnswer, TargetRequest } from "../engine/engine-worker.js" */
/** @import { NextFrame, TrackerWorker } from "./tracker-host.js" */

/**
 * Where frames come from: a video, a camera, or frames of one's own.
 *
 * @typedef {HTMLVideoElement | CameraStream | AsyncIterable<OwnFrame>} FrameSource
 */

/**
 * A focal length that was found from a sheet that bends: of images of `width` x `height` pixels, with its standard deviation
 * (`spread`), all in pixels.
 *
 * @typedef {{ width: number, height: number, focal: number, spread: number }} FoundFocal
 */

/**
 * The events of a session, by what their `detail` holds.
 *
 * @typedef {object} SessionEvents
 * @property {CustomEvent<{ target: Target, copy: number, frame: TrackedFrame }>} found a target, or a further copy of it, is found; told before the
 *   frame is given
 * @property {CustomEvent<{ target: Target, copy: number, frame: TrackedFrame }>} lost it is found no longer; likewise
 * @property {CustomEvent<FoundFocal>} focal the camera's focal length, once the moving, bending sheet has given it away, to 1.5 % or better,
 *   and again as it becomes surer, down to 0.5 %
 * @property {CustomEvent<{ reason: StallReason }>} stalled no frame came for three seconds
 * @property {CustomEvent<null>} interrupted the system has taken the camera away for a while
 * @property {CustomEvent<{ error: unknown }>} ended the session is over: it was closed (`error` is null then), or why
 */

/**
 * @typedef {object} OwnParts
 * @property {readonly Target[]} targets
 * @property {() => TrackerWorker} startTracker starts a worker, which is ended with the session
 * @property {WebAssembly.Module} module
 * @property {Smoothing | null} smooth
 * @property {(target: Target) => TargetRequest} sourceOf
 * @property {(question: Question) => Promise<{ answers: RawAnswer[], estimate: Estimate | null }>} find
 * @typedef {OwnParts & Pick<FollowOptions, "camera" | "calibrate" | "software" | "signal" | "onEstimate">} SessionParts
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

/** So often it is looked whether frames come, milliseconds; where none has so many times in a row, they are stalled. */
const WATCH_MS = 1000;
const STALLED_LOOKS = 3;

/**
 * Targets being followed through a video. It gives each frame that was followed:
 *
 * ```js
 * for await (const frame of sft.follow(camera)) draw(frame);
 * ```
 *
 * It works while it is iterated; leaving the loop closes it. A frame closes itself when the next one is asked for, unless
 * {@link TrackedFrame.keep} was called. {@link SessionEvents} has its events.
 *
 * @extends {Announcer<SessionEvents>}
 */
export class Session extends Announcer {
  #parts;
  #tracker;
  #frames;
  /** @type {CameraStream | null} */
  #stream;
  #patience = new Patience();
  /** Ends all listening. */
  #listening = new AbortController();
  /** What ended it. @type {{ error: unknown } | null} */
  #end = null;
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
  /** How often in a row no frame had come when it was looked. */
  #quiet = 0;
  #watching;
  #iterator;

  /**
   * Use `sft.follow`.
   *
   * @param {FrameSource} source
   * @param {SessionParts} parts
   */
  constructor(source, parts) {
    super();
    this.#parts = parts;
    this.#followed = new Map(parts.targets.map((target) => [target.id, target]));
    const { module, smooth, sourceOf, signal } = parts;
    this.#tracker = new LastingTracker(parts.startTracker, () => ({ module, smooth, targets: this.targets.map(sourceOf) }));
    this.#stream = source instanceof CameraStream ? source : null;
    const video = source instanceof CameraStream ? source.video : source;
    this.#frames = Symbol.asyncIterator in video ? new OwnFrames(video, this.#listening.signal) : new VideoFrames(video, this.#listening.signal, parts.software);
    // The finders look at the first frame while the tracker starts, which then follows it.
    const question = this.#followed.size > 0 ? { ids: [...this.#followed.keys()], onlyConfirms: false } : null;
    this.#next = { focal: CANONICAL_FOCAL, intervalMs: 0, question };
    this.#tracker.start().catch((error) => this.#finish(error));
    // Tells when frames have stopped to come, to a page that is seen.
    this.#watching = setInterval(() => {
      const isAway = this.#stream?.interrupted || (typeof document !== "undefined" && document.visibilityState === "hidden");
      this.#quiet = this.#frames.silentMs >= WATCH_MS && !isAway ? this.#quiet + 1 : 0;
      if (this.#quiet === STALLED_LOOKS) this.tell("stalled", { reason: this.#frames.silence });
    }, WATCH_MS);
    const options = { signal: this.#listening.signal };
    signal?.addEventListener("abort", () => this.#finish(signal.reason), options);
    const stream = this.#stream;
    stream?.addEventListener("interrupted", () => this.tell("interrupted", null), options);
    stream?.signal.addEventListener("abort", () => this.#finish(stream.error), options);
    if (stream?.signal.aborted) this.#finish(stream.error);
    this.#iterator = this.#run();
  }

  /** What it follows. @returns {Target[]} */
  get targets() {
    return [...this.#followed.values()];
  }

  /** Whether it is over. */
  get closed() {
    return this.#end !== null;
  }

  /** The frames, once: a second loop goes on where the first one is. */
  [Symbol.asyncIterator]() {
    return this.#iterator;
  }

  /** Ends it: the loop over its frames ends without an error. */
  close() {
    this.#finish(null);
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }

  /**
   * Follows a target too, from one of the next frames on.
   *
   * @param {Target} target
   * @throws {DeepSftError} `target-unknown`, `closed`
   */
  addTarget(target) {
    const request = this.#parts.sourceOf(target);
    if (this.#end) throw closedError();
    if (this.#followed.has(target.id)) return;
    this.#followed.set(target.id, target);
    this.#tracker.track(request).catch((error) => this.#finish(error));
  }

  /**
   * Follows a target no longer. `lost` is not told of it.
   *
   * @param {Target} target one that is not followed is left alone
   */
  removeTarget({ id }) {
    if (this.#followed.delete(id)) this.#tracker.untrack({ id }).catch(() => undefined);
  }

  /**
   * Depth and registration of a target's mesh in the newest frame, as in an `Estimate`: rows of `width` columns, -1 where the mesh is
   * not seen, and the focal length of the canonical image that they belong to.
   *
   * @param {Target} [target] the first when absent
   * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
   * @throws {DeepSftError} `target-unknown`, `closed`
   */
  async maps(target) {
    const [of] = target ? [target] : this.#followed.values();
    const maps = await this.#tracker.maps({ id: of?.id ?? -1 });
    return { ...maps, depth: scaledDepth(maps.depth, of?.mesh.perMm) };
  }

  /** @param {unknown} error what ends it; null where it is wanted */
  #finish(error) {
    if (this.#end) return;
    this.#end = { error };
    this.#listening.abort();
    clearInterval(this.#watching);
    this.#tracker.terminate(closedError());
    this.tell("ended", { error });
  }

  /** @returns {AsyncGenerator<TrackedFrame, void, void>} */
  async *#run() {
    let next = null;
    // It may have been held back from the start.
    if (this.#stream?.interrupted) this.tell("interrupted", null);
    try {
      while (!this.#end) {
        const current = next ?? (await this.#begin());
        next = null;
        if (!current) break;
        current.ask();
        const { frame, timeMs, camera, grabMs, number } = current;
        /** @type {TrackedFrame | null} */
        let tracked = null;
        try {
          const raw = await current.answer;
          if (this.#end) break;
          this.#next = raw.next;
          // Estimates of frames before are of another camera, or of this one as it was held.
          if (raw.afresh) this.#viewBegan = number;
          const totalMs = performance.now() - current.began;
          // Some may have been removed meanwhile.
          const seen = raw.targets.flatMap((one) => {
            const target = this.#followed.get(one.id);
            if (!target) return [];
            const mesh = one.surface ? new SurfaceMesh(one.surface, target.mesh, "tracking") : null;
            return [{ changed: one.changed, tracked: new TrackedTarget({ ...one, target, mesh }) }];
          });
          const targets = seen.map(({ tracked }) => tracked);
          const times = { captureMs: grabMs + raw.readMs, ...raw.times, totalMs };
          tracked = new TrackedFrame({ number, timeMs, targets, camera, times, networkFps: this.#networkFps, frame });
          // Where a frame waits already, the worker follows it while the page draws this one.
          next = this.#frames.waiting ? await this.#begin(true) : null;
          if (this.#end) break;
          for (const { changed, tracked: { target, copy, found } } of seen)
            if (changed) this.tell(found ? "found" : "lost", { target, copy, frame: tracked });
          yield tracked;
          // The camera may have changed, or been forgotten, since.
          if (!raw.focal || JSON.stringify(camera) !== this.#camera) continue;
          const { width, height } = current.size;
          const focal = (raw.focal.ratio * camera.fx * width) / camera.width;
          const spread = raw.focal.deviation * focal;
          this.#stream?.calibrate(width, height, focal, spread);
          this.tell("focal", { width, height, focal, spread });
        } finally {
          if (!tracked?.kept) (tracked ?? frame).close();
        }
      }
    } catch (error) {
      this.#finish(asDeepSftError(error));
    } finally {
      this.close();
      next?.ask();
      next?.frame.close();
    }
    if (this.#end?.error) throw this.#end.error;
  }

  /** How sure the focal length of a camera is, as the tracker takes it. @param {SourcedCamera} camera */
  #focalDeviation({ source, spread, fx }) {
    const isWanted = this.#parts.calibrate ?? this.#stream !== null;
    if (!isWanted || source === "given" || source === "exif") return 0;
    return (spread ?? (source === "estimated" ? Infinity : 0)) / fx;
  }

  /**
   * Waits for a frame that is worth it, and has the tracker follow it.
   *
   * @param {boolean} [waitsNot] whether only the frame that waits is tried: the one before it must not be held back for another,
   *   which may never come
   * @returns null once closed, and where that frame is not worth it
   */
  async #begin(waitsNot = false) {
    for (let tries = 0; tries === 0 || !waitsNot; tries++) {
      const shownAt = await this.#frames.next();
      if (shownAt === null) return null;
      // Where nothing is looked for nothing is spared.
      const restMs = this.#followed.size > 0 ? this.#followedAt + this.#next.intervalMs - performance.now() : 0;
      if (restMs > 0 && !this.#frames.isPatient) continue;
      if (restMs > 0) await new Promise((resolve) => setTimeout(resolve, restMs));
      const following = await this.#take(shownAt).catch((error) => this.#patience.bear(error));
      if (!following) continue;
      this.#patience.reset();
      if (!this.#end) return following;
      following.ask();
      following.frame.close();
      return null;
    }
    return null;
  }

  /**
   * Takes a frame, and has the tracker follow it. `size` is that with which it came; `ask` has the finders asked about it, once the frame
   * before it is closed.
   *
   * @param {number} timeMs
   * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`, `camera-intrinsics`
   */
  async #take(timeMs) {
    const began = performance.now();
    this.#followedAt = began;
    const { changes } = this.#frames;
    const { frame, width, height } = await this.#frames.grab();
    const { question: wanted } = this.#next;
    try {
      const camera = cameraForFrame(this.#parts.camera ?? this.#stream?.intrinsics, { frame, width, height });
      // What was said of the next frame was said of the camera of the one before.
      const of = JSON.stringify(camera);
      const focal = of === this.#camera ? this.#next.focal : CANONICAL_FOCAL;
      const canonical = canonicalFrame(frame, camera, this.#parts.software, focal);
      const grabMs = performance.now() - began;
      const question = this.#takeQuestion();
      const small = canonical && question?.onlyConfirms ? createImageBitmap(canonical) : null;
      const copies = question && (await Promise.all([createImageBitmap(frame), small]));
      // The frame itself stays here, to be drawn.
      const looked = canonical ?? (await createImageBitmap(frame));
      const afresh = changes !== this.#changes;
      [this.#changes, this.#camera] = [changes, of];
      this.#timeS = Math.max(timeMs / 1000, this.#timeS + 1e-3);
      const number = ++this.#number;
      const intrinsics = canonical ? canonicalIntrinsics(camera, focal) : intrinsicsOf(camera);
      const source = [camera.width, camera.height, ...intrinsicsOf(camera)];
      const focalDeviation = this.#focalDeviation(camera);
      const answer = this.#tracker.follow({ timeS: this.#timeS, afresh, frame: looked, intrinsics, source, focalDeviation, focal, question });
      // It may come to nothing before it is waited for.
      answer.catch(() => undefined);
      // The tracker knows of the question by now, as it must before it hears the answer.
      const ask = () => question && copies && void this.#ask(number, { ids: question.ids, frame: copies[0], canonical: copies[1], camera, focal });
      return { number, timeMs: 1000 * this.#timeS, frame, camera, size: { width, height }, began, grabMs, answer, ask };
    } catch (error) {
      frame.close();
      // It was not asked.
      this.#next = { ...this.#next, question: this.#next.question ?? wanted };
      if (!(error instanceof DOMException)) throw error;
      throw new DeepSftError("image-unreadable", "The browser could not copy a frame.", { cause: error });
    }
  }

  /** The question for the finders, which is asked once; null when there is none. */
  #takeQuestion() {
    const { question } = this.#next;
    if (!question) return null;
    this.#next = { ...this.#next, question: null };
    const ids = question.ids.filter((id) => this.#followed.has(id));
    return ids.length > 0 ? { ...question, ids } : null;
  }

  /**
   * Has the finders look at a frame and the tracker hear of it.
   *
   * @param {number} number of the frame
   * @param {Question} question
   */
  async #ask(number, question) {
    const { find, onEstimate } = this.#parts;
    if (this.#end) {
      question.canonical?.close();
      return question.frame.close();
    }
    const began = performance.now();
    try {
      const { answers, estimate } = await find(question);
      if (this.#end) return estimate?.close();
      const now = performance.now();
      if (Number.isFinite(this.#answeredAt)) this.#networkFps = 1000 / (now - this.#answeredAt);
      this.#answeredAt = now;
      const heard = this.#tracker.answer({ answers, tookMs: now - began, sinceMissedMs: now - this.#frames.missedAt });
      // Should the callback throw, nobody waits for this any more.
      heard.catch(() => undefined);
      if (estimate && number < this.#viewBegan) estimate.close();
      else if (estimate) onEstimate?.(estimate, number);
      const { next } = await heard;
      if (next) this.#next = next;
    } catch (error) {
      this.#finish(error);
    }
  }
}

function closedError() {
  return new DeepSftError("closed", "The session was closed.");
}
