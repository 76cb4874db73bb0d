// The engine in its worker: what finds targets, and meshes for single frames.

import initialise, { Engine, readScan as readScanFiles } from "../../pkg/deepsft_web.js";
import { DeepSftError } from "../error.js";
import { framePixels } from "../frames/frame-pixels.js";
import { closeFrame, decodedPixels } from "../frames/image-input.js";
import { surfaceArrays } from "../results/surface-mesh.js";
import { addSource } from "../targets/add-source.js";
import { COPY_AGAIN, VERSION } from "../version.js";
import { probeWebGpu } from "./webgpu.js";

/** @import { RawEstimate as EngineEstimate, RawFlatPrint, RawMesh } from "../../pkg/deepsft_web.js" */
/** @import { AddedTarget, EngineInfo, EstimateRequest, FindRequest, FlattenRequest, MeshRequest, PhotographRequest, RawEstimate, RawFinding, ScanRequest, StartRequest, TargetDescription, TargetRequest } from "./engine-worker.js" */
/** @import { RawScan } from "../targets/scan.js" */

/** Number of the model's target. */
const MODEL_TARGET = 0;

/** So much of a photograph's file is looked through, bytes: what it tells of its camera is near its beginning. */
const MAX_FILE_BYTES = 1 << 24;

/** @type {Engine | undefined} */
let engine;

/**
 * The device to use, why not WebGPU when `auto` cannot have it, and what the browser says of the adapter: the engine hears only the
 * adapter's description, which browsers leave empty.
 *
 * @param {"auto" | "webgpu" | "cpu"} wanted
 * @returns {Promise<{ device: "webgpu" | "cpu", fallback: EngineInfo["fallback"], adapter?: Partial<EngineInfo> }>}
 */
async function chooseDevice(wanted) {
  if (wanted === "cpu") return { device: "cpu", fallback: null };
  const { usable, software, adapterName, reason } = await probeWebGpu();
  const adapter = { ...(adapterName && { adapterName }), ...(software && { software }) };
  if (wanted === "webgpu") {
    if (!usable) throw new DeepSftError("webgpu-unavailable", reason);
    return { device: "webgpu", fallback: null, adapter };
  }
  if (usable && !software) return { device: "webgpu", fallback: null, adapter };
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
 * @returns {Promise<{ value: { info: EngineInfo, model: TargetDescription | null }, transfer: Transferable[] }>}
 */
export async function start({ module, files, device: wanted }) {
  // Only a network needs a GPU.
  const { device, fallback, adapter } = await chooseDevice(files ? wanted : "cpu");
  await initialise({ module_or_path: module }).catch((cause) => {
    throw new DeepSftError("engine-load", `The engine does not fit its worker (${cause.message}). ${COPY_AGAIN}`, { cause });
  });
  engine = await Engine.create(files ?? undefined, device);
  const info = engine.info();
  if (info.version !== VERSION) throw new DeepSftError("engine-load", `The engine is of deepsft ${info.version}, its worker of ${VERSION}. ${COPY_AGAIN}`);
  const model = engine.describeTarget(MODEL_TARGET) ?? null;
  return { value: { info: { ...info, ...adapter, fallback }, model }, transfer: model ? [model.rgba.buffer] : [] };
}

/**
 * @param {TargetRequest} request
 * @returns {Promise<{ value: AddedTarget, transfer: Transferable[] }>}
 */
export async function addTarget({ id, source }) {
  const alike = await addSource(started(), id, source);
  const value = started().describeTarget(id);
  if (!value) throw new DeepSftError("internal", "The target was not added.");
  return { value: { ...value, alike }, transfer: [value.rgba.buffer] };
}

/** @param {{ id: number }} request */
export function removeTarget({ id }) {
  started().removeTarget(id);
  return { value: undefined, transfer: [] };
}

/**
 * @param {PhotographRequest} request
 * @returns {Promise<{ value: number | undefined, transfer: Transferable[] }>}
 */
export async function exifFocal({ file, width, height }) {
  const bytes = await file.slice(0, MAX_FILE_BYTES).arrayBuffer();
  return { value: await Engine.exifFocal(new Uint8Array(bytes), width, height), transfer: [] };
}

/**
 * @param {ScanRequest} request
 * @returns {Promise<{ value: RawScan, transfer: Transferable[] }>}
 */
export async function readScan({ files, mmPerUnit }) {
  started();
  const value = await readScanFiles(files, mmPerUnit, decodedPixels);
  const { vertices, texture, sheet } = value;
  return { value, transfer: [vertices, texture.rgba, ...(sheet ? [sheet.picture.rgba] : [])].map(({ buffer }) => buffer) };
}

/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
export async function estimate(request) {
  try {
    return await estimated(request);
  } catch (error) {
    // It is not handed back.
    closeFrame(request.frame);
    throw error;
  }
}

/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
async function estimated({ id, frame, intrinsics, source, fit }) {
  const { rgba, readMs } = read(frame);
  const raw = await started().estimate(id, rgba, frame.width, frame.height, new Float64Array(intrinsics), source);
  const { value, transfer } = carried(raw, frame instanceof ImageData ? null : frame, readMs);
  if (fit && value.found && !value.fitted) {
    const { width, focal, depth, registration, canonical } = value;
    value.fitted = await started().mesh(id, width, focal, depth, registration, canonical);
    if (value.fitted) ({ depth: value.depth, registration: value.registration } = value.fitted);
  }
  const { depth, registration, fitted } = value;
  const arrays = [depth, registration, ...(fitted ? surfaceArrays(fitted.surface) : [])];
  return { value, transfer: [...new Set([...transfer, ...arrays.map(({ buffer }) => buffer)])] };
}

/**
 * @param {FindRequest} request
 * @returns {Promise<{ value: RawFinding, transfer: Transferable[] }>}
 */
export async function find({ ids, estimated, frame, intrinsics, focal }) {
  const { rgba, readMs } = read(frame);
  const { width, height } = frame;
  closeFrame(frame);
  const camera = new Float64Array(intrinsics);
  const found = await started().find(new Uint32Array(ids), estimated, rgba, width, height, camera, focal);
  const { answers } = found;
  const transfer = answers.flatMap(({ sightings }) => sightings.map(({ buffer }) => buffer));
  if (!found.estimate) return { value: { answers, estimate: null }, transfer };
  const estimate = carried(found.estimate, null, readMs);
  return { value: { answers, estimate: estimate.value }, transfer: [...transfer, ...estimate.transfer] };
}

/**
 * @param {FlattenRequest} request
 * @returns {Promise<{ value: RawFlatPrint | null, transfer: Transferable[] }>}
 */
export async function flatten({ id, frame, intrinsics, source, columns, unshaded }) {
  const { rgba } = read(frame);
  const { width, height } = frame;
  closeFrame(frame);
  const value = await started().flatten(id, rgba, width, height, new Float64Array(intrinsics), source, columns, unshaded);
  return { value, transfer: value ? [value.rgba.buffer, value.confidence.buffer] : [] };
}

/** @param {ImageBitmap | ImageData} frame */
function read(frame) {
  const began = performance.now();
  const rgba = framePixels(frame);
  return { rgba, readMs: performance.now() - began };
}

/**
 * An estimate as it crosses to the page.
 *
 * @param {EngineEstimate} raw
 * @param {ImageBitmap | null} bitmap handed back
 * @param {number} readMs
 * @returns {{ value: RawEstimate, transfer: Transferable[] }}
 */
function carried(raw, bitmap, readMs) {
  const { depth, registration, mask, canonical } = raw;
  return {
    value: { ...raw, fitted: raw.found ? raw.fitted : null, readMs, bitmap },
    transfer: [...[depth, registration, mask, canonical].map(({ buffer }) => buffer), ...(bitmap ? [bitmap] : [])],
  };
}

/**
 * @param {MeshRequest} request
 * @returns {Promise<{ value: RawMesh | null, transfer: Transferable[] }>}
 */
export async function mesh({ id, width, focal, depth, registration, canonical }) {
  const value = await started().mesh(id, width, focal, depth, registration, canonical ?? undefined);
  const arrays = value ? [...surfaceArrays(value.surface), value.depth, value.registration] : [];
  return { value, transfer: arrays.map(({ buffer }) => buffer) };
}
