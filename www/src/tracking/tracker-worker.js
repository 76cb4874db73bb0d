// The tracker's side of the contract: what its worker and the page say to each other.

import { transferable } from "../engine/engine-worker.js";
import { WorkerCalls } from "../engine/worker-calls.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */

/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */

/** @typedef {{ module: WebAssembly.Module, files: Map<string, Uint8Array>, smooth: Smoothing | null }} TrackerStartRequest */
/** @typedef {{ number: number, timeS: number, frame: ImageBitmap | ImageData, intrinsics: number[] }} FollowRequest */
/** @typedef {{ number: number, depth: Float32Array, registration: Float32Array }} AnswerRequest both empty: not found */

/**
 * What the tracker made of the network's answer.
 *
 * @typedef {"started" | "confirmed" | "restarted" | "dropped" | "ignored"} Verdict
 */

/**
 * The mesh in one frame as it crosses from the worker.
 *
 * @typedef {object} RawTracked
 * @property {boolean} found
 * @property {Float32Array} vertices
 * @property {Float32Array} confidence
 * @property {number} agreement
 * @property {number} iterations
 * @property {{ warpMs: number, trackMs: number }} times
 * @property {number} readMs time to read the frame's pixels
 * @property {ImageBitmap | null} bitmap the frame, handed back
 */

/** The worker that follows the mesh. */
export class TrackerWorker extends WorkerCalls {
  /**
   * @param {TrackerStartRequest} request
   * @returns {Promise<MeshTopology>}
   */
  start(request) {
    return this.call("startTracker", request);
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
   * @returns {Promise<{ verdict: Verdict, answerMs: number }>}
   */
  answer(request) {
    return this.call("answer", request, [request.depth.buffer, request.registration.buffer]);
  }

  /** @returns {Promise<{ depth: Float32Array, registration: Float32Array }>} */
  maps() {
    return this.call("trackedMaps", null);
  }
}
