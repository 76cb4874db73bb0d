// The tracker in its worker: an instance of the module of its own, with the template and without the network.

import initialise, { MeshTracker } from "../../pkg/deepsft_web.js";
import { DeepSftError } from "../error.js";
import { framePixels } from "../frames/frame-pixels.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { AnswerRequest, FollowRequest, RawTracked, TrackerStartRequest, Verdict } from "./tracker-worker.js" */

/** @type {MeshTracker | undefined} */
let tracker;

function started() {
  if (!tracker) throw new DeepSftError("internal", "The tracker has not been started.");
  return tracker;
}

/**
 * @param {TrackerStartRequest} request
 * @returns {Promise<{ value: MeshTopology, transfer: Transferable[] }>}
 */
export async function startTracker({ module, files, smooth }) {
  await initialise({ module_or_path: module });
  tracker = await MeshTracker.create(files, smooth !== null, smooth?.minCutoff, smooth?.beta);
  return { value: tracker.templateMesh(), transfer: [] };
}

/**
 * @param {FollowRequest} request
 * @returns {Promise<{ value: RawTracked, transfer: Transferable[] }>}
 */
export async function follow({ number, timeS, frame, intrinsics }) {
  const began = performance.now();
  const rgba = framePixels(frame);
  const readMs = performance.now() - began;
  const camera = new Float64Array(intrinsics);
  const raw = await started().follow(number, timeS, rgba, frame.width, frame.height, camera);
  try {
    const { found, vertices, confidence, agreement, iterations, times } = raw;
    const bitmap = frame instanceof ImageData ? null : frame;
    return {
      value: { found, vertices, confidence, agreement, iterations, times: { ...times }, readMs, bitmap },
      transfer: [vertices.buffer, confidence.buffer, ...(bitmap ? [bitmap] : [])],
    };
  } finally {
    raw.free();
  }
}

/**
 * @param {AnswerRequest} request
 * @returns {Promise<{ value: { verdict: Verdict, answerMs: number }, transfer: Transferable[] }>}
 */
export async function answer({ number, depth, registration }) {
  const began = performance.now();
  const verdict = await started().answer(number, depth, registration);
  return { value: { verdict, answerMs: performance.now() - began }, transfer: [] };
}

/** @returns {{ value: { depth: Float32Array, registration: Float32Array }, transfer: Transferable[] }} */
export function trackedMaps() {
  const { depth, registration } = started().maps();
  return { value: { depth, registration }, transfer: [depth.buffer, registration.buffer] };
}
