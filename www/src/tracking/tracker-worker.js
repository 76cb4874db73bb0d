// The tracker's side of the contract: what its worker and the page say to each other.

import { WorkerCalls } from "../engine/worker-calls.js";

/** @import { TargetRequest } from "../engine/engine-worker.js" */

/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */

/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */

/** The worker that follows meshes. @extends {WorkerCalls<typeof import("./tracker-host.js")>} */
export class TrackerWorker extends WorkerCalls {
  start = this.calls("startTracker");
  track = this.calls("trackTarget");
  untrack = this.calls("untrackTarget");
  follow = this.calls("follow");
  answer = this.calls("answer");
  maps = this.calls("trackedMaps");
}
