// The estimator as pages use it.

import { fetchBundle } from "./engine/bundle.js";
import { EngineWorker, compileEngine } from "./engine/engine-worker.js";
import { DeepSftError, asDeepSftError } from "./error.js";
import { Estimate } from "./results/estimate.js";
import { closeFrame, transferableFrame } from "./frames/image-input.js";
import { cameraForFrame, intrinsicsOf } from "./camera/intrinsics.js";
import { MeshTracking } from "./tracking/mesh-tracking.js";
import { TrackerWorker } from "./tracking/tracker-worker.js";
import { Tracking } from "./tracking/tracking.js";

/** @import { LoadProgress } from "./engine/bundle.js" */
/** @import { EngineInfo, EngineTemplate, MeshRequest, MeshTopology, StartRequest } from "./engine/engine-worker.js" */
/** @import { ImageInput } from "./frames/image-input.js" */
/** @import { CameraOption } from "./camera/intrinsics.js" */
/** @import { TrackedFrame } from "./results/tracked-frame.js" */
/** @import { Smoothing } from "./tracking/tracker-worker.js" */

/**
 * @typedef {object} LoadOptions
 * @property {"auto" | "webgpu" | "cpu"} [device] `auto` (the default) takes WebGPU when a real GPU offers what the engine
 *   needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
 * @property {(progress: LoadProgress) => void} [onProgress]
 * @property {AbortSignal} [signal] stops loading; the promise then rejects with the signal's reason
 * @property {string | URL} [wasmUrl] address of `deepsft_web_bg.wasm`, where a bundler moved it
 * @property {string | URL} [workerUrl] address of `worker.js`, where a bundler moved it
 * @property {number} [timeoutMs] so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
 *   hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
 */

/**
 * @typedef {object} EstimateOptions
 * @property {CameraOption} [camera] estimated when absent
 * @property {boolean} [fit] fits the template's mesh to the image, starting from the network's maps,
 *   and gives the maps of that mesh; where it explains the image no better the network's own stay. Default false.
 */

/**
 * @typedef {object} TrackMeshOptions
 * @property {CameraOption} [camera] estimated when absent
 * @property {boolean | Smoothing} [smooth] a One-Euro filter of each vertex, for content that must not tremble; `true`
 *   takes its defaults. Default: none.
 * @property {(estimate: Estimate, frame: number) => void} [onEstimate] is given each answer of the network, with the number of
 *   its frame, and owns it: call its `close()` when done
 */

/**
 * What is needed to start the engine again.
 *
 * @typedef {{ request: StartRequest, workerUrl: URL | undefined, timeoutMs: number | undefined }} StartPlan
 */

/** What of a model's files the tracker needs. */
const MODEL_FILE = "model.json";
const TEMPLATE_FOLDER = "template/";

/** A GPU that is lost is started again so many times within an hour; after that the CPU does the work. */
const GPU_RESTARTS_PER_HOUR = 2;
const HOUR_MS = 3_600_000;

const WASM_URL = new URL("../pkg/deepsft_web_bg.wasm", import.meta.url);

/** Shape from template on a worker of its own. */
export class DeepSft {
  /** @type {StartPlan} */
  #plan;
  /** @type {EngineWorker} */
  #worker;
  /** @type {EngineInfo} */
  #info;
  /** @type {EngineTemplate} */
  #template;
  /** @type {Promise<unknown>} settles when the requests so far are done */
  #inFlight = Promise.resolve();
  #requests = 0;
  /** Number of the newest call for a video. */
  #newestCall = 0;
  /** @type {Set<Tracking | MeshTracking>} */
  #trackings = new Set();
  /** When the GPU was started again within the last hour, milliseconds. @type {number[]} */
  #gpuRestarts = [];
  /** @type {Promise<void> | null} settles when the engine has been started again */
  #restarting = null;
  #closed = false;

  /**
   * Use {@link DeepSft.load}.
   *
   * @param {StartPlan} plan
   * @param {{ worker: EngineWorker, info: EngineInfo, template: EngineTemplate }} started
   */
  constructor(plan, { worker, info, template }) {
    this.#plan = plan;
    this.#worker = worker;
    this.#info = info;
    this.#template = template;
  }

  /**
   * Fetches a model and starts the engine on it.
   *
   * @param {string | URL} url folder of the model, relative to the page
   * @param {LoadOptions} [options]
   * @returns {Promise<DeepSft>}
   * @throws {DeepSftError} `engine-load`, `model-load`, `model-corrupt`, `model-version`, `webgpu-unavailable`, `gpu-lost`
   */
  static async load(url, { device = "auto", onProgress, signal, wasmUrl, workerUrl, timeoutMs } = {}) {
    signal?.throwIfAborted();
    const base = typeof document === "undefined" ? self.location.href : document.baseURI;
    const folder = new URL(url, base);
    if (!folder.pathname.endsWith("/")) folder.pathname += "/";
    // Where one download fails the others end with it.
    const downloads = new AbortController();
    const abort = () => downloads.abort(signal?.reason);
    signal?.addEventListener("abort", abort, { once: true });
    let module, files;
    try {
      [module, files] = await Promise.all([
        compileEngine(wasmUrl === undefined ? WASM_URL : new URL(wasmUrl, base), { onProgress, signal: downloads.signal }),
        fetchBundle(folder, { onProgress, signal: downloads.signal }),
      ]);
    } catch (error) {
      downloads.abort(error);
      throw error;
    } finally {
      signal?.removeEventListener("abort", abort);
    }
    onProgress?.({ phase: "start", loadedBytes: 0, totalBytes: null });
    const plan = {
      request: { module, files, device },
      workerUrl: workerUrl === undefined ? undefined : new URL(workerUrl, base),
      timeoutMs,
    };
    return new DeepSft(plan, await startEngine(plan, signal));
  }

  /** What runs the network, and where. */
  get info() {
    return this.#info;
  }

  /**
   * The template's picture, its size in mm, and what of its mesh no frame changes.
   *
   * @returns {{ texture: ImageData, widthMm: number, heightMm: number, mesh: MeshTopology }}
   */
  get template() {
    const { rgba, width, height, sizeMm, mesh } = this.#template;
    return { texture: new ImageData(rgba, width, height), widthMm: sizeMm[0], heightMm: sizeMm[1], mesh };
  }

  /**
   * Registers and measures the template in one image.
   *
   * @param {ImageInput} image
   * @param {EstimateOptions} [options]
   * @returns {Promise<Estimate>}
   * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`, `camera-intrinsics`, `gpu-lost`, `closed`
   */
  estimate(image, options = {}) {
    const began = performance.now();
    this.#requests++;
    const turn = this.#inFlight.then(() => this.#run(image, options, began)).finally(() => this.#requests--);
    this.#inFlight = turn.catch(() => undefined);
    return turn;
  }

  /**
   * The same for a video. One frame is in flight at a time and the newest one wins: called while a frame is under
   * way, this waits and then takes the frame the video shows at that moment; called again before that, the earlier
   * call resolves to null.
   *
   * @param {HTMLVideoElement | VideoFrame | HTMLCanvasElement | OffscreenCanvas} video
   * @param {EstimateOptions} [options]
   * @returns {Promise<Estimate | null>} null when a newer call took its place
   * @throws {DeepSftError} as {@link DeepSft.estimate}
   */
  async estimateForVideo(video, options = {}) {
    const call = ++this.#newestCall;
    while (this.#requests > 0) {
      await this.#inFlight;
      if (call !== this.#newestCall) return null;
    }
    return this.estimate(video, options);
  }

  /**
   * Estimates frame after frame of a video, each newest one, until stopped.
   *
   * @param {HTMLVideoElement} video
   * @param {(estimate: Estimate) => void} onEstimate owns the estimate: call its `close()` when done
   * @param {EstimateOptions} [options]
   * @returns {Tracking}
   */
  track(video, onEstimate, options = {}) {
    return this.#running(new Tracking(video, () => this.estimateForVideo(video, options), onEstimate));
  }

  /**
   * Follows the template's mesh through a video at the camera's rate: a tracker in a worker of its own takes each newest
   * frame, and the network, beside it and at its own rate, tells it where to start, confirms it, and finds the
   * template again when it was lost.
   *
   * @param {HTMLVideoElement} video
   * @param {(tracked: TrackedFrame) => void} onTracked owns the frame: call its `close()` when done
   * @param {TrackMeshOptions} [options]
   * @returns {MeshTracking}
   * @throws {DeepSftError} `closed`, `engine-load`
   * @throws {RangeError} for a `smooth` that is none
   */
  trackMesh(video, onTracked, { camera, smooth = false, onEstimate } = {}) {
    if (this.#closed) throw closedError();
    const { request, workerUrl, timeoutMs } = this.#plan;
    const isNeeded = (/** @type {string} */ name) => name === MODEL_FILE || name.startsWith(TEMPLATE_FOLDER);
    const start = {
      module: request.module,
      files: new Map([...request.files].filter(([name]) => isNeeded(name))),
      smooth: smooth === true ? {} : smooth ? checkedSmoothing(smooth) : null,
    };
    const tracker = new TrackerWorker(workerUrl, timeoutMs);
    const estimate = (/** @type {ImageBitmap} */ frame, /** @type {CameraOption} */ of) =>
      this.estimate(frame, { camera: of });
    return this.#running(new MeshTracking(video, { tracker, start, estimate, camera, onTracked, onEstimate }));
  }

  /**
   * Remembers a loop until it ends, to end it with the rest.
   *
   * @template {Tracking | MeshTracking} T
   * @param {T} tracking
   * @returns {T}
   */
  #running(tracking) {
    this.#trackings.add(tracking);
    // In the chain rather than beside it: an error that nobody waits for is then reported by the browser, once.
    tracking.finished = tracking.finished.finally(() => this.#trackings.delete(tracking));
    return tracking;
  }

  /** Stops the worker and lets everything go; what is under way rejects with `closed`. */
  close() {
    this.#closed = true;
    for (const tracking of this.#trackings) tracking.stop();
    this.#worker.terminate(closedError());
  }

  /**
   * @param {ImageInput} image
   * @param {EstimateOptions} options
   * @param {number} began
   * @returns {Promise<Estimate>}
   */
  async #run(image, { camera: cameraOption, fit = false }, began) {
    const { raw, camera, grabMs } = await this.#onEngine(async (worker) => {
      const grabbing = performance.now();
      const grabbed = await transferableFrame(image);
      const grabMs = performance.now() - grabbing;
      const { frame } = grabbed;
      try {
        const camera = cameraForFrame(cameraOption, grabbed);
        const request = { frame, intrinsics: intrinsicsOf(camera), fit };
        return { raw: await worker.estimate(request), camera, grabMs };
      } catch (error) {
        closeFrame(frame);
        throw error;
      }
    });
    const times = {
      captureMs: grabMs + raw.readMs,
      ...raw.times,
      fitMs: raw.fitted?.solveMs ?? 0,
      totalMs: performance.now() - began,
    };
    const makeMesh = (/** @type {MeshRequest} */ maps) => this.#onEngine((worker) => worker.mesh(maps));
    return new Estimate(raw, camera, times, this.#template.mesh, makeMesh);
  }

  /**
   * Has the engine do something; where it loses its GPU meanwhile, once more after it has been started again.
   *
   * @template T
   * @param {(worker: EngineWorker) => Promise<T>} work
   * @returns {Promise<T>}
   */
  async #onEngine(work) {
    for (;;) {
      if (this.#closed) throw closedError();
      const worker = this.#worker;
      try {
        return await work(worker);
      } catch (error) {
        if (asDeepSftError(error).code !== "gpu-lost" || this.#closed) throw error;
        // Another call may have seen the loss before.
        if (worker === this.#worker)
          await (this.#restarting ??= this.#restart(error).finally(() => (this.#restarting = null)));
      }
    }
  }

  /**
   * Starts the engine afresh after the GPU was lost: on the GPU, or, where it is lost again and again, on the CPU. A lost
   * device poisons the engine's whole module, so the worker goes with it.
   *
   * @param {unknown} loss
   */
  async #restart(loss) {
    this.#worker.terminate(loss);
    const now = Date.now();
    this.#gpuRestarts = this.#gpuRestarts.filter((at) => now - at < HOUR_MS);
    const isWornOut = this.#gpuRestarts.length >= GPU_RESTARTS_PER_HOUR;
    const { request } = this.#plan;
    const message = `The GPU was lost ${GPU_RESTARTS_PER_HOUR + 1} times within an hour.`;
    if (isWornOut && request.device !== "auto") throw new DeepSftError("gpu-lost", message, { cause: loss });
    this.#gpuRestarts.push(now);
    let started;
    try {
      const device = isWornOut ? "cpu" : request.device;
      started = await startEngine({ ...this.#plan, request: { ...request, device } }, undefined);
    } catch (cause) {
      throw new DeepSftError(
        "gpu-lost",
        `The GPU was lost and could not be started again: ${asDeepSftError(cause).message}`,
        { cause },
      );
    }
    if (this.#closed) return started.worker.terminate(closedError());
    const { worker, info, template } = started;
    /** @type {EngineInfo["fallback"]} */
    const fallback = isWornOut ? { code: "gpu-lost", message } : info.fallback;
    [this.#worker, this.#info, this.#template] = [worker, { ...info, fallback }, template];
  }
}

/**
 * Refuses settings that are no numbers; the tracker itself has the defaults of those that are absent.
 *
 * @param {Smoothing} smooth
 * @returns {Smoothing}
 */
function checkedSmoothing(smooth) {
  const { minCutoff, beta } = smooth;
  if (minCutoff !== undefined && !(Number.isFinite(minCutoff) && minCutoff > 0))
    throw new RangeError(`minCutoff is ${minCutoff}, expected a positive number`);
  if (beta !== undefined && !(Number.isFinite(beta) && beta >= 0))
    throw new RangeError(`beta is ${beta}, expected a number that is not negative`);
  return smooth;
}

/**
 * Starts a worker and its engine; under `auto`, when WebGPU promised well but the engine could not start on it, once
 * more on the CPU, in a fresh worker.
 *
 * @param {StartPlan} plan
 * @param {AbortSignal | undefined} signal
 * @returns {Promise<{ worker: EngineWorker, info: EngineInfo, template: EngineTemplate }>}
 */
async function startEngine({ request, workerUrl, timeoutMs }, signal) {
  signal?.throwIfAborted();
  const worker = new EngineWorker(workerUrl, timeoutMs);
  const abort = () => worker.terminate(signal?.reason);
  signal?.addEventListener("abort", abort, { once: true });
  try {
    return { worker, ...(await worker.start(request)) };
  } catch (error) {
    worker.terminate(error);
    signal?.throwIfAborted();
    const { code, message } = asDeepSftError(error);
    const aboutTheGpu = code === "webgpu-unavailable" || code === "gpu-lost" || code === "internal";
    if (request.device !== "auto" || !aboutTheGpu) throw error;
    const started = await startEngine({ request: { ...request, device: "cpu" }, workerUrl, timeoutMs }, signal);
    return { ...started, info: { ...started.info, fallback: { code, message } } };
  } finally {
    signal?.removeEventListener("abort", abort);
  }
}

function closedError() {
  return new DeepSftError("closed", "The estimator was used after close().");
}
