// The tracker's side of the contract: what its worker and the page say to each other.

import { transferable } from "../engine/engine-worker.js";
import { WorkerCalls } from "../engine/worker-calls.js";

/** @import { RawSurface } from "../../pkg/deepsft_web.js" */
/** @import { RawAnswer, TargetRequest } from "../engine/engine-worker.js" */

/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */

/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */
/**
 * A frame of the video.
 *
 * @typedef {object} FollowRequest
 * @property {number} timeS ascending
 * @property {boolean} [afresh] whether another camera or another file begins with it
 * @property {ImageBitmap | ImageData} frame or its canonical image
 * @property {number[]} intrinsics of that
 * @property {number[]} [source] width, height and intrinsics of the camera that took it; those of `frame` when absent
 * @property {number} [focalDeviation] standard deviation of the camera's focal length as a fraction: infinite for a guess, 0 (the
 *   default) where nobody wants it better
 * @property {number} [focal] of the canonical image that it is followed in, pixels; the training camera's when absent
 * @property {FinderQuestion | null} [question] that the finders are asked about it
 */

/** Which targets the finders look for, and whether the canonical image is enough. @typedef {{ ids: number[], onlyConfirms: boolean }} FinderQuestion */

/**
 * What the next frame is for, if the camera stays the same: focal length of its canonical image, pixels; least time after the frame
 * before, milliseconds; what the finders should be asked about it.
 *
 * @typedef {{ focal: number, intervalMs: number, question: FinderQuestion | null }} NextFrame
 */

/** What the finders say, how long that took, and how long ago a frame was missed. @typedef {{ answers: RawAnswer[], tookMs: number, sinceMissedMs: number }} AnswerRequest */

/**
 * What the tracker made of an answer for a target.
 *
 * @typedef {{ id: number, effect: "started" | "confirmed" | "restarted" | "dropped" | "ignored" }} AnswerEffect
 */

/**
 * One copy of a target in a frame, the first with the number 0: `surface` is null unless found.
 *
 * @typedef {{ id: number, copy: number, found: boolean, held: boolean, surface: RawSurface | null, correlation: number, iterations: number }} RawTrackedTarget
 */

/**
 * The meshes in one frame as they cross from the worker.
 *
 * @typedef {object} RawTracked
 * @property {RawTrackedTarget[]} targets
 * @property {boolean} afresh whether all that was seen before was forgotten
 * @property {{ ratio: number, deviation: number } | null} focal the true focal length as a multiple of the given one, where it is told,
 *   and its standard deviation as a fraction
 * @property {NextFrame} next
 * @property {{ warpMs: number, trackMs: number }} times
 * @property {number} readMs time to read the frame's pixels
 */

/** The worker that follows meshes. */
export class TrackerWorker extends WorkerCalls {
  /**
   * @param {TrackerStartRequest} request
   * @returns {Promise<void>}
   */
  start(request) {
    return this.call("startTracker", request);
  }

  /**
   * @param {TargetRequest} target
   * @returns {Promise<void>}
   */
  track(target) {
    return this.call("trackTarget", target);
  }

  /**
   * @param {{ id: number }} request
   * @returns {Promise<void>}
   */
  untrack(request) {
    return this.call("untrackTarget", request);
  }

  /**
   * @param {FollowRequest} request
   * @returns {Promise<RawTracked>}
   */
  follow(request) {
    return this.call("follow", request, [transferable(request.frame)]);
  }

  /**
   * @param {AnswerRequest} request
   * @returns {Promise<{ effects: AnswerEffect[], next: NextFrame | null, answerMs: number }>}
   */
  answer(request) {
    const sightings = request.answers.flatMap(({ sightings }) => sightings);
    return this.call("answer", request, sightings.map(({ buffer }) => buffer));
  }

  /**
   * @param {{ id: number }} request
   * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
   */
  maps(request) {
    return this.call("trackedMaps", request);
  }
}
