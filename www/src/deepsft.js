// The estimator as pages use it.

import { fetchBundle } from "./bundle.js";
import { EngineWorker, compileEngine } from "./engine.js";
import { DeepSftError, asDeepSftError } from "./error.js";
import { Estimate } from "./estimate.js";
import { transferableFrame } from "./image-input.js";
import { cameraForImage, estimatedCamera } from "./intrinsics.js";
import { Tracking } from "./tracking.js";

/** @import { LoadProgress } from "./bundle.js" */
/** @import { EngineInfo, EngineTemplate, StartRequest } from "./engine.js" */
/** @import { ImageInput } from "./image-input.js" */
/** @import { Camera, CameraSource, SourcedCamera } from "./intrinsics.js" */

/**
 * A camera, or a function that gives the camera for an image size; after a phone is turned it is asked again.
 * Without one the camera is estimated.
 *
 * @typedef {(Camera & { source?: CameraSource }) | ((width: number, height: number) => Camera & { source?: CameraSource })} CameraOption
 */

/**
 * @typedef {object} LoadOptions
 * @property {"auto" | "webgpu" | "cpu"} [device] `auto` (the default) takes WebGPU when a real GPU offers what the engine
 *   needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
 * @property {(progress: LoadProgress) => void} [onProgress]
 * @property {AbortSignal} [signal] stops loading; the promise then rejects with the signal's reason
 * @property {string | URL} [wasmUrl] address of `deepsft_web_bg.wasm`, where a bundler moved it
 * @property {string | URL} [workerUrl] address of `worker.js`, where a bundler moved it
 */

/** @typedef {{ camera?: CameraOption }} EstimateOptions */

/** What is needed to start the engine again. @typedef {{ request: StartRequest, workerUrl: URL | undefined }} StartPlan */

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
  /** @type {Set<Tracking>} */
  #trackings = new Set();
  #gpuRecreated = false;
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
  static async load(url, { device = "auto", onProgress, signal, wasmUrl, workerUrl } = {}) {
    signal?.throwIfAborted();
    const base = typeof document === "undefined" ? self.location.href : document.baseURI;
    const folder = new URL(url, base);
    if (!folder.pathname.endsWith("/")) folder.pathname += "/";
    const [module, files] = await Promise.all([
      compileEngine(wasmUrl === undefined ? WASM_URL : new URL(wasmUrl, base), { onProgress, signal }),
      fetchBundle(folder, { onProgress, signal }),
    ]);
    onProgress?.({ phase: "start", loadedBytes: 0, totalBytes: null });
    const plan = {
      request: { module, files, device },
      workerUrl: workerUrl === undefined ? undefined : new URL(workerUrl, base),
    };
    return new DeepSft(plan, await startEngine(plan, signal));
  }

  /** What runs the network, and where. */
  get info() {
    return this.#info;
  }

  /**
   * The template's picture and its size in mm.
   *
   * @returns {{ texture: ImageData, widthMm: number, heightMm: number }}
   */
  get template() {
    const { rgba, width, height, sizeMm } = this.#template;
    return { texture: new ImageData(rgba, width, height), widthMm: sizeMm[0], heightMm: sizeMm[1] };
  }

  /**
   * Registers and measures the template in one image.
   *
   * @param {ImageInput} image
   * @param {EstimateOptions} [options]
   * @returns {Promise<Estimate>}
   * @throws {DeepSftError} `image-unreadable`, `camera-intrinsics`, `gpu-lost`, `closed`
   */
  estimate(image, { camera } = {}) {
    const began = performance.now();
    this.#requests++;
    const turn = this.#inFlight.then(() => this.#run(image, camera, began)).finally(() => this.#requests--);
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
  async estimateForVideo(video, { camera } = {}) {
    const call = ++this.#newestCall;
    while (this.#requests > 0) {
      await this.#inFlight;
      if (call !== this.#newestCall) return null;
    }
    return this.estimate(video, { camera });
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
    const tracking = new Tracking(video, () => this.estimateForVideo(video, options), onEstimate);
    this.#trackings.add(tracking);
    const forget = () => this.#trackings.delete(tracking);
    tracking.finished.then(forget, forget);
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
   * @param {CameraOption | undefined} cameraOption
   * @param {number} began
   * @returns {Promise<Estimate>}
   */
  async #run(image, cameraOption, began) {
    if (this.#closed) throw closedError();
    const grabbing = performance.now();
    const { frame, width, height } = await transferableFrame(image);
    const grabMs = performance.now() - grabbing;
    const camera = scaledCamera(cameraOption, width, height, frame);
    const { fx, fy, cx, cy, distortion } = camera;
    const intrinsics = [fx, fy, cx, cy, ...distortion];
    let raw;
    try {
      raw = await this.#worker.estimate({ frame, intrinsics });
    } catch (error) {
      await this.#recoverFrom(asDeepSftError(error));
      const again = await transferableFrame(image);
      raw = await this.#worker.estimate({ frame: again.frame, intrinsics });
    }
    const times = { captureMs: grabMs + raw.readMs, ...raw.times, totalMs: performance.now() - began };
    return new Estimate(raw, camera, times);
  }

  /**
   * Starts the engine afresh after the GPU was lost for the first time; throws every other error on. A lost device
   * poisons the engine's whole module, so the worker goes with it.
   *
   * @param {DeepSftError} error
   */
  async #recoverFrom(error) {
    if (error.code !== "gpu-lost" || this.#gpuRecreated || this.#closed) throw error;
    this.#gpuRecreated = true;
    this.#worker.terminate(error);
    try {
      const { worker, info, template } = await startEngine(this.#plan, undefined);
      [this.#worker, this.#info, this.#template] = [worker, info, template];
    } catch (cause) {
      throw new DeepSftError(
        "gpu-lost",
        `The GPU was lost and could not be started again: ${asDeepSftError(cause).message}`,
        { cause },
      );
    }
    if (this.#closed) this.close();
  }
}

/**
 * Starts a worker and its engine; under `auto`, when WebGPU promised well but the engine could not start on it, once
 * more on the CPU, in a fresh worker.
 *
 * @param {StartPlan} plan
 * @param {AbortSignal | undefined} signal
 * @returns {Promise<{ worker: EngineWorker, info: EngineInfo, template: EngineTemplate }>}
 */
async function startEngine({ request, workerUrl }, signal) {
  signal?.throwIfAborted();
  const worker = new EngineWorker(workerUrl);
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
    const started = await startEngine({ request: { ...request, device: "cpu" }, workerUrl }, signal);
    return { ...started, info: { ...started.info, fallback: { code, message } } };
  } finally {
    signal?.removeEventListener("abort", abort);
  }
}

/**
 * The camera of an image that may have been made smaller on its way.
 *
 * @param {CameraOption | undefined} option
 * @param {number} width of the image as it came, pixels
 * @param {number} height
 * @param {{ width: number, height: number }} frame as it goes to the engine
 * @returns {SourcedCamera}
 */
function scaledCamera(option, width, height, frame) {
  const camera =
    option === undefined
      ? estimatedCamera(width, height)
      : typeof option === "function"
        ? option(width, height)
        : option;
  return cameraForImage(cameraForImage(camera, width, height), frame.width, frame.height);
}

function closedError() {
  return new DeepSftError("closed", "The estimator was used after close().");
}
