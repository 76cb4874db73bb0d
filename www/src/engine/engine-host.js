// The engine in its worker: the network, and meshes for single frames.

import initialise, { Engine } from "../../pkg/deepsft_web.js";
import { DeepSftError } from "../error.js";
import { framePixels } from "../frames/frame-pixels.js";
import { probeWebGpu } from "./webgpu.js";

/** @import { EngineInfo, EngineTemplate, EstimateRequest, MeshRequest, RawEstimate, RawMesh, StartRequest } from "./engine-worker.js" */

/** @type {Engine | undefined} */
let engine;

/**
 * The device to use, and why not WebGPU when `auto` cannot have it.
 *
 * @param {"auto" | "webgpu" | "cpu"} wanted
 * @returns {Promise<{ device: "webgpu" | "cpu", fallback: EngineInfo["fallback"] }>}
 */
async function chooseDevice(wanted) {
  if (wanted === "cpu") return { device: "cpu", fallback: null };
  const { usable, software, reason } = await probeWebGpu();
  if (wanted === "webgpu") {
    if (!usable) throw new DeepSftError("webgpu-unavailable", reason);
    return { device: "webgpu", fallback: null };
  }
  if (usable && !software) return { device: "webgpu", fallback: null };
  // An emulated adapter takes many times as long as the CPU path on the same processor.
  const message = usable ? "WebGPU here is only emulated in software, which is slower than the CPU itself." : reason;
  return { device: "cpu", fallback: { code: "webgpu-unavailable", message } };
}

function started() {
  if (!engine) throw new DeepSftError("internal", "The engine has not been started.");
  return engine;
}

/**
 * @param {StartRequest} request
 * @returns {Promise<{ value: { info: EngineInfo, template: EngineTemplate }, transfer: Transferable[] }>}
 */
export async function start({ module, files, device: wanted }) {
  const { device, fallback } = await chooseDevice(wanted);
  await initialise({ module_or_path: module });
  engine = await Engine.create(files, device);
  const { width, height, rgba } = engine.templateTexture();
  const [widthMm, heightMm] = engine.templateSizeMm();
  const texture = new Uint8ClampedArray(rgba);
  return {
    value: {
      info: { ...engine.info(), fallback },
      template: { width, height, rgba: texture, sizeMm: [widthMm, heightMm], mesh: engine.templateMesh() },
    },
    transfer: [texture.buffer],
  };
}

/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
export async function estimate({ frame, intrinsics, fit }) {
  const began = performance.now();
  const rgba = framePixels(frame);
  const readMs = performance.now() - began;
  const raw = await started().estimate(rgba, frame.width, frame.height, new Float64Array(intrinsics));
  try {
    const { depth, registration, mask, canonical, found, confidence, times } = raw;
    const { warpMs, networkMs, judgeMs } = times;
    const fitted = fit && found ? await solvedMesh({ depth, registration, canonical }) : null;
    const bitmap = frame instanceof ImageData ? null : frame;
    const maps = fitted?.accepted ? fitted : { depth, registration };
    return {
      value: {
        depth: maps.depth,
        registration: maps.registration,
        mask,
        canonical,
        found,
        confidence,
        times: { warpMs, networkMs, judgeMs },
        readMs,
        bitmap,
        fitted,
      },
      transfer: [
        maps.depth.buffer,
        maps.registration.buffer,
        mask.buffer,
        canonical.buffer,
        ...(fitted ? [fitted.vertices.buffer, fitted.confidence.buffer] : []),
        ...(bitmap ? [bitmap] : []),
      ],
    };
  } finally {
    raw.free();
  }
}

/**
 * @param {MeshRequest} request
 * @returns {Promise<{ value: RawMesh | null, transfer: Transferable[] }>}
 */
export async function mesh(request) {
  const value = await solvedMesh(request);
  const arrays = value ? [value.vertices, value.confidence, value.depth, value.registration] : [];
  return { value, transfer: arrays.map(({ buffer }) => buffer) };
}

/**
 * @param {MeshRequest} request
 * @returns {Promise<RawMesh | null>}
 */
async function solvedMesh({ depth, registration, canonical }) {
  const raw = await (canonical === null
    ? started().complete(depth, registration)
    : started().fit(depth, registration, canonical));
  if (!raw) return null;
  try {
    const { accepted, vertices, confidence, depth, registration, solveMs } = raw;
    return { accepted, vertices, confidence, depth, registration, solveMs };
  } finally {
    raw.free();
  }
}
