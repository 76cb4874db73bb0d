// The tracker in its worker: an instance of the module of its own, with the targets and without finders. What its functions return is handed over, not copied.

import initialise, { MeshTracker } from "../../pkg/deepsft_web.js";
import { CANONICAL_FOCAL } from "../camera/canonical.js";
import { DeepSftError } from "../error.js";
import { closeFrame, readFrame } from "../frames/image-input.js";
import { addSource } from "../targets/add-source.js";

/** @import { RawAnswer, TargetRequest } from "../engine/engine-worker.js" */
/** @import { WorkerCalls } from "../engine/worker-calls.js" */

/** The worker that follows meshes. @typedef {WorkerCalls<typeof import("./tracker-host.js")>} TrackerWorker */

/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */

/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */

/** What waits for the tracker to start waits in turn. @type {Promise<MeshTracker> | undefined} */
let tracker;

async function started() {
  if (!tracker) throw new DeepSftError("internal", "The tracker has not been started.");
  return tracker;
}

/** @param {TrackerStartRequest} request */
export async function startTracker({ module, targets, smooth }) {
  tracker = initialise({ module_or_path: module }).then(async () => {
    const started = new MeshTracker(smooth !== null, smooth?.minCutoff, smooth?.beta);
    for (const { id, source } of targets) await addSource(started, id, source);
    return started;
  });
  await tracker;
}

/** @param {TargetRequest} target */
export async function trackTarget({ id, source }) {
  await addSource(await started(), id, source);
}

/** @param {{ id: number }} request */
export async function untrackTarget({ id }) {
  (await started()).removeTarget(id);
}

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
 * @property {NextFrame["question"]} [question] that the finders are asked about it
 */

/**
 * What the next frame is for, if the camera stays the same: focal length of its canonical image, pixels; least time after the frame
 * before, milliseconds; what the finders should be asked about it, and whether the canonical image is enough for that.
 *
 * @typedef {Awaited<ReturnType<MeshTracker["follow"]>>["next"]} NextFrame
 */

/** @param {FollowRequest} request */
export async function follow({ timeS, afresh = false, frame, intrinsics, source, focalDeviation = 0, focal = CANONICAL_FOCAL, question }) {
  const { rgba, width, height, readMs } = readFrame(frame);
  closeFrame(frame);
  const [camera, taken] = [intrinsics, source ?? [width, height, ...intrinsics]].map((numbers) => new Float64Array(numbers));
  const asked = question ? new Uint32Array(question.ids) : undefined;
  const tracker = await started();
  const onlyConfirms = question?.onlyConfirms ?? false;
  const { warpMs, trackMs, ...followed } = await tracker.follow(
    timeS, afresh, rgba, width, height, camera, taken, focalDeviation, focal, asked, onlyConfirms,
  );
  return { ...followed, times: { warpMs, trackMs }, readMs };
}

/** What the finders say, how long that took, and how long ago a frame was missed. @typedef {{ answers: RawAnswer[], tookMs: number, sinceMissedMs: number }} FinderAnswers */

/** @param {FinderAnswers} request */
export async function answer({ answers, tookMs, sinceMissedMs }) {
  const tracker = await started();
  const began = performance.now();
  const made = await tracker.answer(answers, tookMs, sinceMissedMs);
  return { ...made, answerMs: performance.now() - began };
}

/** @param {{ id: number }} request */
export async function trackedMaps({ id }) {
  return (await started()).maps(id);
}
