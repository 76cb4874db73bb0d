// The tracker in its worker: an instance of the module of its own, with the targets and without finders.

import initialise, { MeshTracker } from "../../pkg/deepsft_web.js";
import { CANONICAL_FOCAL } from "../camera/canonical.js";
import { DeepSftError } from "../error.js";
import { framePixels } from "../frames/frame-pixels.js";
import { closeFrame } from "../frames/image-input.js";
import { surfaceArrays } from "../results/surface-mesh.js";
import { addSource } from "../targets/add-source.js";

/** @import { TargetRequest } from "../engine/engine-worker.js" */
/** @import { AnswerEffect, AnswerRequest, FollowRequest, NextFrame, RawTracked, TrackerStartRequest } from "./tracker-worker.js" */

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

/** @param {TargetRequest} target */
export async function trackTarget({ id, source }) {
  await addSource(await started(), id, source);
  return { value: undefined, transfer: [] };
}

/** @param {{ id: number }} request */
export async function untrackTarget({ id }) {
  (await started()).removeTarget(id);
  return { value: undefined, transfer: [] };
}

/**
 * @param {FollowRequest} request
 * @returns {Promise<{ value: RawTracked, transfer: Transferable[] }>}
 */
export async function follow({ timeS, afresh = false, frame, intrinsics, source, focalDeviation = 0, focal = CANONICAL_FOCAL, question }) {
  const began = performance.now();
  const rgba = framePixels(frame);
  const readMs = performance.now() - began;
  const { width, height } = frame;
  closeFrame(frame);
  const [camera, taken] = [intrinsics, source ?? [width, height, ...intrinsics]].map((numbers) => new Float64Array(numbers));
  const asked = question ? new Uint32Array(question.ids) : undefined;
  const tracker = await started();
  const onlyConfirms = question?.onlyConfirms ?? false;
  const { warpMs, trackMs, ...followed } = await tracker.follow(
    timeS, afresh, rgba, width, height, camera, taken, focalDeviation, focal, asked, onlyConfirms,
  );
  const transfer = followed.targets.flatMap(({ surface }) => (surface ? surfaceArrays(surface) : [])).map(({ buffer }) => buffer);
  return { value: { ...followed, times: { warpMs, trackMs }, readMs }, transfer };
}

/**
 * @param {AnswerRequest} request
 * @returns {Promise<{ value: { effects: AnswerEffect[], next: NextFrame | null, answerMs: number }, transfer: Transferable[] }>}
 */
export async function answer({ answers, tookMs, sinceMissedMs }) {
  const tracker = await started();
  const began = performance.now();
  const { effects, next } = await tracker.answer(answers, tookMs, sinceMissedMs);
  return { value: { effects, next, answerMs: performance.now() - began }, transfer: [] };
}

/**
 * @param {{ id: number }} request
 * @returns {Promise<{ value: { width: number, focal: number, depth: Float32Array, registration: Float32Array }, transfer: Transferable[] }>}
 */
export async function trackedMaps({ id }) {
  const { width, focal, depth, registration } = await (await started()).maps(id);
  return { value: { width, focal, depth, registration }, transfer: [depth.buffer, registration.buffer] };
}
