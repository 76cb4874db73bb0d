// The engine's side of the contract: what the worker and the page say to each other.

import { countedBody } from "./bundle.js";
import { DeepSftError, asDeepSftError } from "./error.js";

/** @import { LoadProgress } from "./bundle.js" */
/** @import { DeepSftErrorCode } from "./error.js" */

/**
 * What runs the network.
 *
 * @typedef {object} EngineInfo
 * @property {"webgpu" | "cpu"} device
 * @property {string} adapterName the GPU adapter's name, or what runs on the CPU
 * @property {boolean} software whether a WebGPU adapter is emulated on the CPU
 * @property {string} modelName
 * @property {number} parameters of the network
 * @property {string} version of this package
 * @property {{ code: DeepSftErrorCode, message: string } | null} fallback why `device: "auto"` took the CPU
 */

/**
 * Milliseconds in the engine: canonical warp, network, confidence.
 *
 * @typedef {{ warpMs: number, networkMs: number, judgeMs: number }} EngineTimes
 */

/**
 * The maps of one frame as they cross from the worker.
 *
 * @typedef {object} RawEstimate
 * @property {Float32Array} depth
 * @property {Float32Array} registration
 * @property {Uint8Array} mask
 * @property {Uint8ClampedArray} canonical
 * @property {boolean} found
 * @property {number} confidence
 * @property {EngineTimes} times
 * @property {number} readMs time to read the frame's pixels
 * @property {ImageBitmap | null} bitmap the frame, handed back
 */

/** @typedef {{ width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer>, sizeMm: [number, number] }} EngineTemplate */

/** @typedef {{ module: WebAssembly.Module, files: Map<string, Uint8Array>, device: "auto" | "webgpu" | "cpu" }} StartRequest */
/** @typedef {{ frame: ImageBitmap | ImageData, intrinsics: number[] }} EstimateRequest intrinsics are fx, fy, cx, cy, k1, k2, p1, p2, k3 */

/**
 * Compiles the WebAssembly module while it downloads.
 *
 * @param {URL} url
 * @param {object} [options]
 * @param {(progress: LoadProgress) => void} [options.onProgress]
 * @param {AbortSignal} [options.signal]
 * @returns {Promise<WebAssembly.Module>}
 * @throws {DeepSftError} `engine-load`
 */
export async function compileEngine(url, { onProgress, signal } = {}) {
  try {
    const response = await fetch(url, { signal });
    if (!response.ok) throw new Error(`the server answered ${response.status}`);
    // Content-Length counts compressed bytes when the server compresses; then the total is unknown.
    const length = response.headers.has("content-encoding") ? null : response.headers.get("content-length");
    const totalBytes = length === null ? null : Number(length);
    let loadedBytes = 0;
    const body = countedBody(response, (bytes) => {
      loadedBytes += bytes;
      onProgress?.({ phase: "engine", loadedBytes, totalBytes });
    });
    return await WebAssembly.compileStreaming(new Response(body, { headers: { "content-type": "application/wasm" } }));
  } catch (error) {
    signal?.throwIfAborted();
    const reason = error instanceof Error ? error.message : String(error);
    const hint = "If a bundler moved the file, pass its address as wasmUrl.";
    throw new DeepSftError("engine-load", `The engine ${url} could not be loaded (${reason}). ${hint}`, {
      cause: error,
    });
  }
}

/**
 * A module worker at `url`. From another origin (a CDN) it starts through a small script of this page's own.
 *
 * @param {URL} url
 * @returns {Worker}
 */
function startForeignWorker(url) {
  const script = new Blob([`import ${JSON.stringify(url.href)};`], { type: "text/javascript" });
  const blobUrl = URL.createObjectURL(script);
  const worker = new Worker(blobUrl, { type: "module", name: "deepsft" });
  worker.addEventListener("message", () => URL.revokeObjectURL(blobUrl), { once: true });
  return worker;
}

/** The worker that hosts the engine, as calls that return promises. */
export class EngineWorker {
  /** @type {Worker} */
  #worker;
  /** @type {Map<number, { resolve: (value: any) => void, reject: (error: unknown) => void }>} */
  #waiting = new Map();
  #lastId = 0;
  #started = false;
  /** @type {{ reason: unknown } | null} why no call can be answered any more */
  #ended = null;

  /** @param {URL | undefined} url address of worker.js where the bundler cannot find it itself */
  constructor(url) {
    const own = new URL("./worker.js", import.meta.url);
    const foreign = url ?? (own.origin === self.location.origin ? undefined : own);
    // The literal form is what bundlers recognise.
    this.#worker =
      foreign === undefined
        ? new Worker(new URL("./worker.js", import.meta.url), { type: "module", name: "deepsft" })
        : foreign.origin === self.location.origin
          ? new Worker(foreign, { type: "module", name: "deepsft" })
          : startForeignWorker(foreign);
    this.#worker.addEventListener("message", ({ data: { id, value, error } }) => {
      const call = this.#waiting.get(id);
      this.#waiting.delete(id);
      if (error) call?.reject(asDeepSftError(error));
      else call?.resolve(value);
      this.#started = true;
    });
    this.#worker.addEventListener("error", (event) => {
      event.preventDefault();
      const reason =
        event.message || "its script could not be loaded; if a bundler moved it, pass its address as workerUrl";
      this.#end(new DeepSftError(this.#started ? "internal" : "engine-load", `The engine's worker failed: ${reason}.`));
    });
    this.#worker.addEventListener("messageerror", () =>
      this.#end(new DeepSftError("internal", "A message to the engine was lost.")),
    );
  }

  /**
   * @param {StartRequest} request
   * @returns {Promise<{ info: EngineInfo, template: EngineTemplate }>}
   */
  start(request) {
    return this.#call("start", request);
  }

  /**
   * @param {EstimateRequest} request
   * @returns {Promise<RawEstimate>}
   */
  estimate(request) {
    const { frame } = request;
    return this.#call("estimate", request, [frame instanceof ImageBitmap ? frame : frame.data.buffer]);
  }

  /**
   * Ends the worker; what is under way, and every later call, rejects with `reason`.
   *
   * @param {unknown} reason
   */
  terminate(reason) {
    this.#worker.terminate();
    this.#end(reason);
  }

  /**
   * @param {"start" | "estimate"} method
   * @param {StartRequest | EstimateRequest} request
   * @param {Transferable[]} [transfer]
   * @returns {Promise<any>}
   */
  #call(method, request, transfer = []) {
    if (this.#ended) return Promise.reject(this.#ended.reason);
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, method, request }, transfer);
    });
  }

  /** @param {unknown} reason */
  #end(reason) {
    this.#ended ??= { reason };
    for (const { reject } of this.#waiting.values()) reject(reason);
    this.#waiting.clear();
  }
}
