// Frames that the engine works on, one after the other.

import { unlessAborted } from "./abort.js";
import { cameraForFrame, centredCamera, intrinsicsOf } from "./camera/intrinsics.js";
import { closedError } from "./engine/lasting-engine.js";
import { DeepSftError } from "./error.js";
import { canonicalIntrinsics } from "./frames/canonical-frame.js";
import { closeFrame, readImage, transferableFrame } from "./frames/image-input.js";
import { Estimate } from "./results/estimate.js";

/** @import { CameraOption, CameraSource, ImageInput, SourcedCamera, Target } from "./index.js" */
/** @import { EngineWorker, MeshRequest, RawEstimate } from "./engine/engine-worker.js" */
/** @import { LastingEngine } from "./engine/lasting-engine.js" */
/** @import { Question } from "./tracking/session.js" */

/**
 * @typedef {object} EstimateOptions
 * @property {Target} [target] what to look for; when absent the model's own target, else the only one there is
 * @property {CameraOption} [camera] when absent what a photograph's EXIF data tell, if the image is a Blob or File with some; else
 *   estimated. Either way a tilted or bent sheet tells it better, and then `estimate.camera.source` is `calibrated`
 * @property {AbortSignal} [signal] rejects at once with its reason
 * @property {boolean} [fit] fits the target's mesh to the image, starting from the network's maps,
 *   and gives the maps of that mesh; where it explains the image no better the network's own stay. Default false. What is found
 *   by its features is fitted in any case.
 */

/**
 * @typedef {object} FlattenOptions
 * @property {number} [width] pixels of the flat print, 16 to 4096; default 1024. Its height follows.
 * @property {boolean} [unshaded] divides shadows, uneven light and its colour out of it; what is written on the print stays. Default false
 * @property {Target} [target] as for `estimate`
 * @property {CameraOption} [camera] as for `estimate`
 * @property {AbortSignal} [signal] rejects at once with its reason
 */

/**
 * A print as an image shows it, laid flat: `confidence` is how much the image shows of each pixel, row-major, 0 to 1, and 0 where the
 * print is out of the image, turned away, or hidden by itself or by something else. What is not shown is white.
 *
 * @typedef {{ image: ImageData, confidence: Float32Array }} FlatPrint
 */

/** Widths of a flat print, pixels. */
const [MIN_WIDTH, MAX_WIDTH] = [16, 4096];

/** Has the engine look at frames, one at a time. */
export class FrameRequests {
  #engine;
  #chosen;
  /** @type {Promise<unknown>} settles when the requests so far are done */
  #inFlight = Promise.resolve();

  /**
   * @param {LastingEngine} engine
   * @param {(target: Target | undefined) => Target} chosen gives the target that is meant, or throws
   */
  constructor(engine, chosen) {
    this.#engine = engine;
    this.#chosen = chosen;
  }

  /**
   * @param {ImageInput} image
   * @param {EstimateOptions} options
   */
  async estimate(image, { fit = false, ...options }) {
    const began = performance.now();
    const ask = this.#ask(image, options, (worker, request) => worker.call("estimate", { ...request, fit }), (late) => late.answer.bitmap?.close());
    const { answer, ...of } = await ask;
    return this.#estimateOf(answer, { ...of, began });
  }

  /**
   * @param {ImageInput} image
   * @param {FlattenOptions} options
   * @returns {Promise<FlatPrint | null>}
   */
  async flatten(image, { width = 1024, unshaded = false, ...options }) {
    if (!(width >= MIN_WIDTH && width <= MAX_WIDTH)) throw new DeepSftError("invalid-argument", `The flat print is to be ${width} pixels wide, expected ${MIN_WIDTH} to ${MAX_WIDTH}`);
    const columns = Math.round(width);
    const { answer } = await this.#ask(image, options, (worker, request) => worker.call("flatten", { ...request, columns, unshaded }));
    return answer && { image: new ImageData(answer.rgba, answer.width), confidence: answer.confidence };
  }

  /**
   * Has the finders look for targets in a frame.
   *
   * @param {Question} question
   * @param {boolean} estimated whether the network's answer is wanted as an estimate too
   */
  find({ ids, frame, canonical, camera, focal }, estimated) {
    return this.#inTurn(async () => {
      const began = performance.now();
      const intrinsics = canonical ? canonicalIntrinsics(camera, focal) : intrinsicsOf(camera);
      let estimate = null;
      try {
        const { answers, estimate: raw } = await this.#engine.run(async (worker) => {
          const copy = await createImageBitmap(canonical ?? frame);
          return worker.call("find", { ids, estimated, frame: copy, intrinsics, focal }).finally(() => copy.close());
        });
        if (raw) estimate = this.#estimateOf({ ...raw, bitmap: frame }, { target: this.#chosen(undefined), camera, grabMs: 0, began });
        return { answers, estimate };
      } finally {
        canonical?.close();
        if (!estimate) frame.close();
      }
    });
  }

  /**
   * Runs requests one after the other.
   *
   * @template T
   * @param {() => Promise<T>} request
   */
  #inTurn(request) {
    const turn = this.#inFlight.then(request);
    this.#inFlight = turn.catch(() => undefined);
    return turn;
  }

  /**
   * Asks the engine something of a target in an image, in turn.
   *
   * @template T
   * @param {ImageInput} input
   * @param {{ target?: Target, camera?: CameraOption, signal?: AbortSignal }} options
   * @param {(worker: EngineWorker, request: { id: number, frame: ImageBitmap | ImageData, intrinsics: number[], source: CameraSource }) => Promise<T>} question
   * @param {(late: { answer: T }) => void} [letGo] takes an answer that nobody waits for any more
   */
  async #ask(input, { target: wanted, camera: cameraOption, signal }, question, letGo) {
    const image = await readImage(input, signal);
    const asked = async () => {
      signal?.throwIfAborted();
      if (this.#engine.closed) throw closedError();
      const target = this.#chosen(wanted);
      return this.#engine.run(async (worker) => {
        const grabbing = performance.now();
        const grabbed = await transferableFrame(image);
        const grabMs = performance.now() - grabbing;
        const { frame, width, height } = grabbed;
        try {
          const exifFocal = !cameraOption && image instanceof Blob ? await worker.call("exifFocal", { file: image, width, height }) : undefined;
          const known = exifFocal === undefined ? cameraOption : centredCamera(width, height, exifFocal, "exif");
          const camera = cameraForFrame(known, grabbed);
          const request = { id: target.id, frame, intrinsics: intrinsicsOf(camera), source: camera.source };
          return { answer: await question(worker, request), target, camera, grabMs };
        } finally {
          closeFrame(frame);
        }
      });
    };
    return unlessAborted(this.#inTurn(asked), signal, letGo);
  }

  /**
   * @param {RawEstimate} raw
   * @param {{ target: Target, camera: SourcedCamera, grabMs: number, began: number }} of
   */
  #estimateOf(raw, { target, camera, grabMs, began }) {
    const times = {
      captureMs: grabMs + raw.readMs,
      ...raw.times,
      fitMs: raw.fitted?.solveMs ?? 0,
      totalMs: performance.now() - began,
    };
    const makeMesh = (/** @type {MeshRequest} */ maps) => this.#engine.run((worker) => worker.call("mesh", maps));
    if (!raw.told) return new Estimate(raw, camera, times, target, makeMesh);
    // The sheet has told the camera; the deviation is a fraction of its focal length.
    const [fx, fy, cx, cy, deviation] = raw.told;
    return new Estimate(raw, { ...camera, fx, fy, cx, cy, source: "calibrated", spread: deviation * fx }, times, target, makeMesh);
  }
}
