// The tracker in its worker: an instance of the module of its own, with the targets and without finders.

import initialise, { MeshTracker } from "../../pkg/deepsft_web.js";
import { CANONICAL_FOCAL } from "../camera/canonical.js";
import { DeepSftError } from "../error.js";
import { framePixels } from "../frames/frame-pixels.js";
import { closeFrame } from "../frames/image-input.js";
import { addSource } from "../targets/add-source.js";

/** @import { AnswerRequest, FollowRequest, RawTracked, TrackerStartRequest, Verdict } from "./tracker-worker.js" */

/** What waits for the tracker to start waits in turn. @type {Promise<MeshTracker> | undefined} */
let tracker;

async function started() {
  if (!tracker) throw new DeepSftError("internal", "The tracker has not been started.");
  return tracker;
}

/**
 * @param {TrackerStartRequest} request
 * @returns {Promise<{ value: void, transfer: Transferable[] }>}
 */
export async function startTracker(request) {
  tracker = start(request);
  await tracker;
  return { value: undefined, transfer: [] };
}

/** @param {TrackerStartRequest} request */
async function start({ module, targets, smooth }) {
  await initialise({ module_or_path: module });
  const tracker = new MeshTracker(smooth !== null, smooth?.minCutoff, smooth?.beta);
  for (const { id, source } of targets) await addSource(tracker, id, source);
  return tracker;
}

/** @param {{ id: number }} request */
export async function unfollow({ id }) {
  (await started()).removeTarget(id);
  return { value: undefined, transfer: [] };
}

/**
 * @param {FollowRequest} request
 * @returns {Promise<{ value: RawTracked, transfer: Transferable[] }>}
 */
export async function follow({ number, timeS, frame, intrinsics, focal = CANONICAL_FOCAL, calibrate = false }) {
  const began = performance.now();
  const rgba = framePixels(frame);
  const readMs = performance.now() - began;
  const camera = new Float64Array(intrinsics);
  const { width, height } = frame;
  closeFrame(frame);
  const answer = await (await started()).follow(number, timeS, rgba, width, height, camera, focal, calibrate);
  const { targets, warpMs, trackMs } = answer;
  const transfer = targets.flatMap(({ vertices, confidence }) => [vertices.buffer, confidence.buffer]);
  return { value: { targets, focal: answer.focal, times: { warpMs, trackMs }, readMs }, transfer };
}

/**
 * @param {AnswerRequest} request
 * @returns {Promise<{ value: { verdict: Verdict, answerMs: number }, transfer: Transferable[] }>}
 */
export async function answer({ id, number, sightings, canDeny }) {
  const tracker = await started();
  const began = performance.now();
  /** @type {Verdict} */
  let verdict = "ignored";
  if (sightings.length === 0 && canDeny)
    verdict = await tracker.answer(id, number, 0, new Float32Array(), new Float32Array());
  // The likeliest comes first.
  for (const { width, depth, registration } of sightings) {
    verdict = await tracker.answer(id, number, width, depth, registration);
    if (verdict !== "ignored") break;
  }
  return { value: { verdict, answerMs: performance.now() - began }, transfer: [] };
}

/**
 * @param {{ id: number }} request
 * @returns {Promise<{ value: { width: number, focal: number, depth: Float32Array, registration: Float32Array }, transfer: Transferable[] }>}
 */
export async function trackedMaps({ id }) {
  const { width, focal, depth, registration } = await (await started()).maps(id);
  return { value: { width, focal, depth, registration }, transfer: [depth.buffer, registration.buffer] };
}
