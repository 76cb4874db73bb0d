// The engine's side of the contract: what the worker and the page say to each other.

import { DeepSftError } from "../error.js";

/** @import { DeepSftErrorCode, LoadOptions } from "../index.js" */
/** @import { Engine, RawEstimate as EngineEstimate } from "../../pkg/deepsft_web.js" */
/** @import { TargetSource } from "../targets/target-source.js" */
/** @import { WorkerCalls } from "./worker-calls.js" */

/** The worker that finds targets. @typedef {WorkerCalls<typeof import("./engine-host.js")>} EngineWorker */

/**
 * What runs the network.
 *
 * @typedef {object} EngineInfo
 * @property {"webgpu" | "cpu"} device
 * @property {string} adapterName the GPU adapter's name, or what runs on the CPU
 * @property {boolean} software whether a WebGPU adapter is emulated on the CPU
 * @property {string | null} modelName null without a model
 * @property {number} parameters of the network; 0 without a model
 * @property {string} version of this package
 * @property {{ code: DeepSftErrorCode, message: string } | null} fallback why `device: "auto"` took the CPU
 */

/**
 * The maps of one frame as they cross from the worker: with the time to read the frame's pixels, and the frame where it is handed back.
 *
 * @typedef {EngineEstimate & { readMs: number, bitmap: ImageBitmap | null }} RawEstimate
 */

/**
 * What of a mesh no frame changes: three vertex indices per face, counter-clockwise seen from the front, and (u, v) of each
 * vertex.
 *
 * `perMm` is there where the print's size is not known: a millimetre of the engine's in units of its width.
 *
 * @typedef {{ faces: Uint32Array, textureCoordinates: Float32Array, perMm?: number }} MeshTopology
 */

/**
 * How well a print will be found: `good`, `fair` (lost in hard views), `poor` (found now and then, or mistaken), or `hopeless`. The
 * reasons are sentences for people, the worst first; none where nothing is wrong.
 *
 * @typedef {{ level: "hopeless" | "poor" | "fair" | "good", reasons: string[] }} PictureGrade
 */

/** @typedef {NonNullable<ReturnType<Engine["describeTarget"]>>} TargetDescription */
/** @typedef {{ module: WebAssembly.Module, files: Map<string, Uint8Array> | null, device: "auto" | "webgpu" | "cpu" }} StartRequest */
/** @typedef {{ id: number, source: TargetSource }} TargetRequest */

/**
 * What the finders say of one target in a frame: the vertices of its mesh (x, y, z each, camera frame, mm), the likeliest first.
 *
 * @typedef {{ id: number, sightings: Float32Array[] }} RawAnswer
 */

/**
 * With the canonical image: a mesh fitted to it. Without: ARAP completion of the maps.
 *
 * @typedef {{ id: number, width: number, focal: number, depth: Float32Array, registration: Float32Array, canonical: Uint8ClampedArray | null }} MeshRequest
 */

/** Where development servers of Vite keep the packages that they have bundled. */
const MOVED_BY_VITE = /\/\.vite\//;

/**
 * Compiles the WebAssembly module while it downloads.
 *
 * Browsers keep compiled code beside the response it came from, so the response itself is compiled, and its bytes are
 * counted on a copy.
 *
 * @param {URL} url
 * @param {Pick<LoadOptions, "onProgress" | "signal">} [options]
 * @throws {DeepSftError} `engine-load`
 */
export async function compileEngine(url, { onProgress, signal } = {}) {
  try {
    const response = await fetch(url, { signal });
    if (!response.ok) throw new Error(`the server answered ${response.status}`);
    const { headers, body } = response.clone();
    // Content-Length counts compressed bytes when the server compresses; then the total is unknown.
    const length = headers.has("content-encoding") ? null : headers.get("content-length");
    const totalBytes = length === null ? null : Number(length);
    let loadedBytes = 0;
    const write = (/** @type {Uint8Array} */ { byteLength }) => onProgress?.({ phase: "engine", loadedBytes: (loadedBytes += byteLength), totalBytes });
    const counted = body?.pipeTo(new WritableStream({ write }));
    // Some servers do not know the type; then the browser compiles only bytes.
    const isTyped = /^application\/wasm$/i.test(headers.get("content-type") ?? "");
    const compiled = isTyped
      ? WebAssembly.compileStreaming(response)
      : response.arrayBuffer().then((bytes) => WebAssembly.compile(bytes));
    const [module] = await Promise.all([compiled, counted]);
    return module;
  } catch (error) {
    signal?.throwIfAborted();
    const reason = error instanceof Error ? error.message : String(error);
    const hint = MOVED_BY_VITE.test(url.href)
      ? 'Vite before 8 has moved the package away from it: add optimizeDeps: { exclude: ["deepsft"] } to its configuration.'
      : "If a bundler does not find it, serve a copy of the package's folder dist and pass its address as baseUrl.";
    throw new DeepSftError("engine-load", `The engine ${url} could not be loaded (${reason}). ${hint}`, {
      cause: error,
    });
  }
}
