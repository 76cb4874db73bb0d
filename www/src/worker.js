// The module worker that hosts the engine, so that no frame ever blocks the page.

import initialise, { Engine } from "../pkg/deepsft_web.js";
import { DeepSftError, asDeepSftError } from "./error.js";
import { probeWebGpu } from "./webgpu.js";

/** @import { EngineInfo, EngineTemplate, EstimateRequest, RawEstimate, StartRequest } from "./engine.js" */

/** @type {Engine | undefined} */
let engine;

/** @type {OffscreenCanvas | undefined} */
let canvas;

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

/**
 * @param {StartRequest} request
 * @returns {Promise<{ info: EngineInfo, template: EngineTemplate }>}
 */
async function start({ module, files, device: wanted }) {
  const { device, fallback } = await chooseDevice(wanted);
  await initialise({ module_or_path: module });
  engine = await Engine.create(files, device);
  const { width, height, rgba } = engine.templateTexture();
  const [widthMm, heightMm] = engine.templateSizeMm();
  return {
    info: { ...engine.info(), fallback },
    template: { width, height, rgba: new Uint8ClampedArray(rgba), sizeMm: [widthMm, heightMm] },
  };
}

/**
 * The pixels of a frame, sRGB, not premultiplied.
 *
 * @param {ImageBitmap | ImageData} frame
 * @returns {Uint8ClampedArray}
 */
function pixels(frame) {
  if (frame instanceof ImageData) return frame.data;
  const { width, height } = frame;
  if (canvas?.width !== width || canvas.height !== height) canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new DeepSftError("internal", "This browser offers no canvas to read a frame with.");
  context.drawImage(frame, 0, 0);
  return context.getImageData(0, 0, width, height).data;
}

/**
 * @param {EstimateRequest} request
 * @returns {Promise<RawEstimate>}
 */
async function estimate({ frame, intrinsics }) {
  if (!engine) throw new DeepSftError("internal", "The engine has not been started.");
  const began = performance.now();
  const rgba = pixels(frame);
  const readMs = performance.now() - began;
  const raw = await engine.estimate(rgba, frame.width, frame.height, new Float64Array(intrinsics));
  try {
    const { depth, registration, mask, canonical, found, confidence, times } = raw;
    const { warpMs, networkMs, judgeMs } = times;
    const bitmap = frame instanceof ImageData ? null : frame;
    return {
      depth,
      registration,
      mask,
      canonical,
      found,
      confidence,
      times: { warpMs, networkMs, judgeMs },
      readMs,
      bitmap,
    };
  } finally {
    raw.free();
  }
}

/**
 * @param {unknown} error
 * @returns {DeepSftError}
 */
function explained(error) {
  if (!(error instanceof WebAssembly.RuntimeError)) return asDeepSftError(error);
  return new DeepSftError("internal", `The engine stopped because of a defect (${error.message}). Load it again.`);
}

self.addEventListener("message", async ({ data: { id, method, request } }) => {
  try {
    const value = method === "start" ? await start(request) : await estimate(request);
    /** @type {Transferable[]} */
    const transfer = [];
    if ("depth" in value) {
      transfer.push(value.depth.buffer, value.registration.buffer, value.mask.buffer, value.canonical.buffer);
      if (value.bitmap) transfer.push(value.bitmap);
    } else {
      transfer.push(value.template.rgba.buffer);
    }
    self.postMessage({ id, value }, { transfer });
  } catch (error) {
    const { code, message } = explained(error);
    self.postMessage({ id, error: { code, message } });
  }
});
