// The engine in its worker: what finds targets, and meshes for single frames. What its functions return is handed over, not copied.

import initialise, { Engine, readScan as readScanFiles } from "../../pkg/deepsft_web.js";
import { DeepSftError } from "../error.js";
import { closeFrame, decodedPixels, readFrame } from "../frames/image-input.js";
import { addSource } from "../targets/add-source.js";
import { MODEL_TARGET } from "../targets/target.js";
import { COPY_AGAIN, VERSION } from "../version.js";
import { probeWebGpu } from "./webgpu.js";

/** @import { CameraSource } from "../camera/intrinsics.js" */
/** @import { EngineInfo, MeshRequest, RawEstimate, StartRequest, TargetRequest } from "./engine-worker.js" */

/** What is looked at, and its fx, fy, cx, cy, k1, k2, p1, p2, k3. @typedef {{ frame: ImageBitmap | ImageData, intrinsics: number[] }} Looked */

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
  if (usable && (wanted === "webgpu" || !software)) return { device: "webgpu", fallback: null, adapter };
  if (wanted === "webgpu") throw new DeepSftError("webgpu-unavailable", reason);
  // An emulated adapter takes many times as long as the CPU path on the same processor.
  const message = usable ? "WebGPU here is only emulated in software, which is slower than the CPU itself." : reason;
  return { device: "cpu", fallback: { code: "webgpu-unavailable", message } };
}

function started() {
  if (!engine) throw new DeepSftError("internal", "The engine has not been started.");
  return engine;
}

/** @param {StartRequest} request */
export async function start({ module, files, device: wanted }) {
  // Only a network needs a GPU.
  const { device, fallback, adapter } = await chooseDevice(files ? wanted : "cpu");
  await initialise({ module_or_path: module }).catch((cause) => {
    throw new DeepSftError("engine-load", `The engine does not fit its worker (${cause.message}). ${COPY_AGAIN}`, { cause });
  });
  engine = await Engine.create(files ?? undefined, device);
  /** @type {EngineInfo} */
  const info = { ...engine.info(), ...adapter, fallback };
  if (info.version !== VERSION) throw new DeepSftError("engine-load", `The engine is of deepsft ${info.version}, its worker of ${VERSION}. ${COPY_AGAIN}`);
  return { info, model: engine.describeTarget(MODEL_TARGET) ?? null };
}

/** @param {TargetRequest} request */
export async function addTarget({ id, source }) {
  const alike = await addSource(started(), id, source);
  const description = started().describeTarget(id);
  if (!description) throw new DeepSftError("internal", "The target was not added.");
  return { ...description, alike };
}

/** @param {{ id: number }} request */
export function removeTarget({ id }) {
  started().removeTarget(id);
}

/**
 * The focal length that a photograph's EXIF data tell, pixels.
 *
 * @param {{ file: Blob, width: number, height: number }} request with the size of the picture as it is shown
 */
export async function exifFocal({ file, width, height }) {
  const bytes = await file.slice(0, MAX_FILE_BYTES).arrayBuffer();
  return Engine.exifFocal(new Uint8Array(bytes), width, height);
}

/** @param {{ files: Map<string, Uint8Array>, mmPerUnit: number | undefined }} request */
export function readScan({ files, mmPerUnit }) {
  started();
  return readScanFiles(files, mmPerUnit, decodedPixels);
}

/** @param {Looked & { id: number, source: CameraSource, fit: boolean }} request whose bitmap is handed back */
export async function estimate({ id, frame, intrinsics, source, fit }) {
  try {
    const { rgba, width, height, readMs } = readFrame(frame);
    const raw = await started().estimate(id, rgba, width, height, new Float64Array(intrinsics), source);
    /** @type {RawEstimate} */
    const value = { ...raw, readMs, bitmap: frame instanceof ImageData ? null : frame };
    if (fit && value.found && !value.fitted) {
      value.fitted = await started().mesh(id, value.width, value.focal, value.depth, value.registration, value.canonical);
      if (value.fitted) ({ depth: value.depth, registration: value.registration } = value.fitted);
    }
    return value;
  } catch (error) {
    closeFrame(frame);
    throw error;
  }
}

/** @param {Looked & { ids: number[], estimated: boolean, focal: number }} request with the canonical image's focal length, pixels */
export async function find({ ids, estimated, frame, intrinsics, focal }) {
  const { rgba, width, height, readMs } = readFrame(frame);
  closeFrame(frame);
  const found = await started().find(new Uint32Array(ids), estimated, rgba, width, height, new Float64Array(intrinsics), focal);
  return { answers: found.answers, estimate: found.estimate ? { ...found.estimate, readMs, bitmap: null } : null };
}

/** @param {Looked & { id: number, source: CameraSource, columns: number, unshaded: boolean }} request */
export function flatten({ id, frame, intrinsics, source, columns, unshaded }) {
  const { rgba, width, height } = readFrame(frame);
  closeFrame(frame);
  return started().flatten(id, rgba, width, height, new Float64Array(intrinsics), source, columns, unshaded);
}

/** @param {MeshRequest} request */
export function mesh({ id, width, focal, depth, registration, canonical }) {
  return started().mesh(id, width, focal, depth, registration, canonical ?? undefined);
}
