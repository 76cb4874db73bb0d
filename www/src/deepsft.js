// The estimator as pages use it.

import { unlessAborted } from "./abort.js";
import { folderOf, isAddress } from "./address.js";
import { cameraForFrame, centredCamera, intrinsicsOf } from "./camera/intrinsics.js";
import { bundleFiles, fetchBundle } from "./engine/bundle.js";
import { compileEngine } from "./engine/engine-worker.js";
import { LastingEngine, closedError, startEngine } from "./engine/lasting-engine.js";
import { requireBrowser } from "./engine/requirements.js";
import { WorkerCalls } from "./engine/worker-calls.js";
import { DeepSftError } from "./error.js";
import { canonicalIntrinsics } from "./frames/canonical-frame.js";
import { closeFrame, readImage, transferableFrame } from "./frames/image-input.js";
import { Estimate } from "./results/estimate.js";
import { Scan, scanFiles } from "./targets/scan.js";
import { isSamePicture, pictureSource, templateSource, unusable } from "./targets/target-source.js";
import { MODEL_TARGET, Target, unknownTarget } from "./targets/target.js";
import { Session } from "./tracking/session.js";

/** @import { CameraOption, CameraSource, FrameSource, ImageInput, LoadOptions, PictureOptions, ScanInput, Smoothing, SourcedCamera, TargetKind, TemplateInput } from "./index.js" */
/** @import { ModelInput } from "./engine/bundle.js" */
/** @import { EngineWorker, MeshRequest, RawEstimate } from "./engine/engine-worker.js" */
/** @import { TargetSource } from "./targets/target-source.js" */
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

/**
 * @typedef {object} FollowOptions
 * @property {Iterable<Target>} [targets] what to follow; when absent all there are, also those that are added later. With none the frames
 *   are given all the same.
 * @property {CameraOption} [camera] when absent that of the `CameraStream`, else estimated
 * @property {boolean} [calibrate] whether the focal length is looked for where it is not known well: it is told as `focal`, and a `CameraStream`
 *   is calibrated with it. Default: of a `CameraStream` true, else false. Depth is off by as much as the focal length is.
 * @property {boolean | Smoothing} [smooth] a One-Euro filter of each vertex, for content that must not tremble; `true`
 *   takes its defaults. Default: none.
 * @property {boolean} [software] whether the browser draws with the processor, for it has no GPU: frames are then read from the video's
 *   memory where they lie there, rather than drawn. Default false.
 * @property {AbortSignal} [signal] ends the session; the loop over its frames then throws the signal's reason
 * @property {(estimate: Estimate, frame: number) => void} [onEstimate] is given each answer of the model's network, with the number
 *   of its frame, and owns it: call its `close()` when done
 */

/** Widths of a flat print, pixels. */
const [MIN_WIDTH, MAX_WIDTH] = [16, 4096];

const WASM_NAME = "deepsft_web_bg.wasm";
/** Bundlers know only this form. */
const WASM_URL = new URL("../dist/deepsft_web_bg.wasm", import.meta.url);

/** Shape from template on a worker of its own. */
export class DeepSft {
  #engine;
  /** By number. @type {Map<number, Target>} */
  #targets = new Map();
  #lastTarget = MODEL_TARGET;
  /** Settles when the requests so far are done. @type {Promise<unknown>} */
  #inFlight = Promise.resolve();
  /** Those that run, and whether they follow all there is. @type {Map<Session, boolean>} */
  #sessions = new Map();

  /**
   * Use {@link DeepSft.load}.
   *
   * @param {LastingEngine} engine
   */
  constructor(engine) {
    this.#engine = engine;
    if (engine.model) this.#targets.set(MODEL_TARGET, new Target(MODEL_TARGET, engine.info.modelName ?? "", "model", engine.model));
  }

  /**
   * Starts the engine, on a model that is fetched, or without one, for pictures alone: these need no training, no network and no
   * GPU.
   *
   * @param {ModelInput | null} [model]
   * @param {LoadOptions} [options]
   * @throws {DeepSftError} `browser-unsupported`, `engine-load`, `model-load`, `model-corrupt`, `model-version`, `webgpu-unavailable`,
   *   `gpu-lost`
   */
  static async load(model, { device = "auto", keep = true, headers, onProgress, signal, baseUrl, timeoutMs } = {}) {
    signal?.throwIfAborted();
    requireBrowser();
    const dist = baseUrl === undefined ? null : folderOf(baseUrl);
    // Where one download fails the others end with it.
    const downloads = new AbortController();
    const fetching = { onProgress, signal: downloads.signal };
    signal?.addEventListener("abort", () => downloads.abort(signal.reason), { signal: downloads.signal });
    const [module, files] = await Promise.all([
      compileEngine(dist ? new URL(WASM_NAME, dist) : WASM_URL, fetching),
      isAddress(model) ? fetchBundle(folderOf(model), { ...fetching, keep, headers }) : model ? bundleFiles(model) : null,
    ]).finally(() => downloads.abort());
    onProgress?.({ phase: "start", loadedBytes: 0, totalBytes: null });
    const plan = {
      request: { module, files, device },
      workerUrl: dist ? new URL("worker.js", dist) : undefined,
      timeoutMs,
    };
    return new DeepSft(new LastingEngine(plan, await startEngine(plan, signal)));
  }

  /** What runs the network, and where. Without a model: what looks for pictures. */
  get info() {
    return this.#engine.info;
  }

  /**
   * All that can be looked for, the model's own target first.
   *
   * @returns {Target[]}
   */
  get targets() {
    return [...this.#targets.values()];
  }

  /**
   * Makes a target of a picture that is printed on something that bends. Nothing is trained.
   *
   * Transparent parts count as white paper, large pictures are made smaller. The same pixels twice are refused: two targets
   * with one picture cannot be told apart. `alike` of the answer names the targets that it resembles.
   *
   * @param {ImageInput} image
   * @param {PictureOptions} [options]
   * @returns {Promise<Target>}
   * @throws {DeepSftError} `target-unusable`, `image-unreadable`, `image-cross-origin`, `closed`, `invalid-argument` for a number of copies
   *   that is none
   */
  async addPicture(image, options = {}) {
    const source = await pictureSource(image, options);
    const [, inAddress] = (isAddress(image) && /([^/?#]+)\/?(?:[?#].*)?$/.exec(String(image))) || [];
    const fileName = image instanceof File ? image.name : inAddress;
    return this.#addTarget("picture", options.name ?? fileName ?? "picture", source, options.signal);
  }

  /**
   * Makes a target of a template's folder, as `deepsft template` writes it: a sheet or an object with a volume, found like a picture.
   *
   * @param {TemplateInput} input address of the folder, relative to the page, or its files
   * @param {{ name?: string }} [options]
   * @throws {DeepSftError} `model-load`, `model-version`, `target-unusable`, `closed`
   */
  async addTemplate(input, { name = "template" } = {}) {
    return this.#addTarget("template", name, await templateSource(input));
  }

  /**
   * Reads a scan: its shape, its texture, and the flat sheet it unrolls to. Scans of bent sheets, labels and plates unroll; what has a
   * volume does not.
   *
   * @param {ScanInput} input
   * @param {{ mmPerUnit?: number }} [options] millimetres of the file's unit; default 1000 for glTF, which counts in metres, and 1 for OBJ and PLY,
   *   which do not say
   * @throws {DeepSftError} `model-load`, `target-unusable`, `closed`
   */
  async readScan(input, { mmPerUnit } = {}) {
    const files = await scanFiles(input);
    return new Scan(await this.#engine.run((worker) => worker.call("readScan", { files, mmPerUnit })), files);
  }

  /**
   * Makes a target of a scan: of the flat sheet that it unrolls to, found and followed like a picture, or of the object with its volume.
   *
   * @param {Scan | ScanInput} input
   * @param {{ widthMm?: number, mmPerUnit?: number, name?: string }} [options] width of the flat sheet, where the scan's is not right; as for
   *   {@link DeepSft.readScan}; a name for people
   * @returns {Promise<Target>} of the kind `picture` or, with a volume, `template`
   * @throws {DeepSftError} as {@link DeepSft.readScan} and {@link DeepSft.addPicture}; `target-unusable` for the width of what is no sheet
   */
  async addScan(input, { widthMm, mmPerUnit, name } = {}) {
    const scan = input instanceof Scan ? input : await this.readScan(input, { mmPerUnit });
    name ??= scan.name;
    if (scan.sheet) {
      const { picture, widthMm: scannedMm, heightMm } = scan.sheet;
      // Its pixels say the height only as far as they are whole.
      const scale = (widthMm ?? scannedMm) / scannedMm;
      return this.addPicture(picture, { widthMm: scale * scannedMm, heightMm: scale * heightMm, name });
    }
    if (widthMm !== undefined)
      throw unusable(`${scan.name} has no width when it is laid flat, for it has a volume (${scan.refusal}): give mmPerUnit instead.`);
    return this.#addTarget("template", name, { kind: "scan", files: scan.files, mmPerUnit: scan.mmPerUnit });
  }

  /**
   * Looks for a target no longer, also where it is being followed.
   *
   * @param {Target} target one that was added; the model's own stays
   * @throws {DeepSftError} `target-unknown`, `target-unusable`
   */
  removeTarget(target) {
    const { id } = this.#chosen(target);
    if (id === MODEL_TARGET)
      throw unusable("The model's own target cannot be removed; leave it out of the targets that are followed.");
    this.#targets.delete(id);
    this.#engine.removeTarget(id);
    for (const session of this.#sessions.keys()) session.removeTarget(target);
  }

  /**
   * @param {TargetKind} kind
   * @param {string} name
   * @param {TargetSource} source
   * @param {AbortSignal} [signal]
   */
  async #addTarget(kind, name, source, signal) {
    const refuseTwins = () => {
      signal?.throwIfAborted();
      const twin = this.targets.find(({ id }) => isSamePicture(this.#engine.sources.get(id), source));
      if (twin) throw unusable(`This picture is a target already ("${twin.name}"): the two could not be told apart.`);
    };
    refuseTwins();
    const id = ++this.#lastTarget;
    const description = await this.#engine.run((worker) => worker.call("addTarget", { id, source }));
    this.#engine.sources.set(id, source);
    try {
      refuseTwins();
    } catch (error) {
      this.#engine.removeTarget(id);
      throw error;
    }
    const target = new Target(id, name, kind, description, source.kind !== "picture" || source.hasSize);
    for (const { id, share } of description.alike.sort((a, b) => b.share - a.share)) {
      const other = this.#targets.get(id);
      if (other) target.alike.push({ target: other, share });
    }
    this.#targets.set(id, target);
    for (const [session, followsAll] of this.#sessions) if (followsAll) session.addTarget(target);
    return target;
  }

  /**
   * The target that is meant.
   *
   * @param {Target | undefined} target
   * @throws {DeepSftError} `target-unknown`
   */
  #chosen(target) {
    if (target !== undefined) {
      if (this.#targets.get(target?.id) === target) return target;
      throw unknownTarget("The target was removed, or belongs to another DeepSft.");
    }
    const { targets } = this;
    if (targets.length === 1 || targets[0]?.kind === "model") return targets[0];
    throw unknownTarget(
      targets.length === 0
        ? "There is nothing to look for: load a model, or add a picture."
        : `There are ${targets.length} targets: say which one is meant.`,
    );
  }

  /**
   * Registers and measures a target in one image.
   *
   * @param {ImageInput} image
   * @param {EstimateOptions} [options]
   * @throws {DeepSftError} `target-unknown`, `image-unreadable`, `image-cross-origin`, `camera-intrinsics`, `gpu-lost`, `closed`
   */
  async estimate(image, { fit = false, ...options } = {}) {
    const began = performance.now();
    const ask = this.#ask(image, options, (worker, request) => worker.call("estimate", { ...request, fit }), (late) => late.answer.bitmap?.close());
    const { answer, ...of } = await ask;
    return this.#estimateOf(answer, { ...of, began });
  }

  /**
   * Lays a print flat as one image shows it: found, fitted to the image's own pixels, and each place of the print looked up in the image.
   * For forms, labels, drawings on a print.
   *
   * @param {ImageInput} image
   * @param {FlattenOptions} [options]
   * @returns {Promise<FlatPrint | null>} null where the print is not found
   * @throws {DeepSftError} as `estimate`
   * @throws {DeepSftError} `invalid-argument` for a width that is none
   */
  async flatten(image, { width = 1024, unshaded = false, ...options } = {}) {
    if (!(width >= MIN_WIDTH && width <= MAX_WIDTH)) throw new DeepSftError("invalid-argument", `The flat print is to be ${width} pixels wide, expected ${MIN_WIDTH} to ${MAX_WIDTH}`);
    const columns = Math.round(width);
    const { answer } = await this.#ask(image, options, (worker, request) => worker.call("flatten", { ...request, columns, unshaded }));
    return answer && { image: new ImageData(answer.rgba, answer.width), confidence: answer.confidence };
  }

  /**
   * Follows the meshes of targets through a video at the camera's rate: a tracker in a worker of its own takes each newest
   * frame, and the finders, beside it and at their own rate, tell it where to start, confirm it, and find
   * targets again that were lost.
   *
   * @param {FrameSource} source
   * @param {FollowOptions} [options]
   * @returns {Session} of frames, to be iterated: `for await (const frame of session)`
   * @throws {DeepSftError} `closed`, `engine-load`, `target-unknown`
   * @throws {DeepSftError} `invalid-argument` for a `smooth` that is none
   */
  follow(source, { targets: wanted, smooth = false, signal, ...options } = {}) {
    signal?.throwIfAborted();
    if (this.#engine.closed) throw closedError();
    const targets = [...new Set(wanted ?? this.targets)].map((target) => this.#chosen(target));
    const { request, workerUrl, timeoutMs } = this.#engine.plan;
    const session = new Session(source, {
      ...options,
      ...{ targets, signal, module: request.module },
      smooth: smooth === true ? {} : smooth ? checkedSmoothing(smooth) : null,
      startTracker: () => new WorkerCalls(workerUrl, timeoutMs),
      sourceOf: (target) => ({ id: this.#chosen(target).id, source: /** @type {TargetSource} */ (this.#engine.sources.get(target.id)) }),
      find: (/** @type {Question} */ question) => this.#find(question, options.onEstimate !== undefined),
    });
    if (!session.closed) this.#sessions.set(session, wanted === undefined);
    session.addEventListener("ended", () => this.#sessions.delete(session));
    return session;
  }

  /** Stops the worker and lets everything go; what is under way rejects with `closed`. */
  close() {
    for (const session of this.#sessions.keys()) session.close();
    this.#engine.close();
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }

  /**
   * Has the finders look for targets in a frame.
   *
   * @param {Question} question
   * @param {boolean} estimated whether the network's answer is wanted as an estimate too
   */
  #find({ ids, frame, canonical, camera, focal }, estimated) {
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
    const fitted = raw.found ? raw.fitted : null;
    const times = {
      captureMs: grabMs + raw.readMs,
      ...raw.times,
      fitMs: fitted?.solveMs ?? 0,
      totalMs: performance.now() - began,
    };
    const makeMesh = (/** @type {MeshRequest} */ maps) => this.#engine.run((worker) => worker.call("mesh", maps));
    if (!raw.told) return new Estimate({ ...raw, fitted }, camera, times, target, makeMesh);
    // The sheet has told the camera; the deviation is a fraction of its focal length.
    const [fx, fy, cx, cy, deviation] = raw.told;
    return new Estimate({ ...raw, fitted }, { ...camera, fx, fy, cx, cy, source: "calibrated", spread: deviation * fx }, times, target, makeMesh);
  }
}

/**
 * Refuses settings that are no numbers; the tracker itself has the defaults of those that are absent.
 *
 * @param {Smoothing} smooth
 */
function checkedSmoothing(smooth) {
  const { minCutoff, beta } = smooth;
  if (minCutoff !== undefined && !(Number.isFinite(minCutoff) && minCutoff > 0))
    throw new DeepSftError("invalid-argument", `minCutoff is ${minCutoff}, expected a positive number`);
  if (beta !== undefined && !(Number.isFinite(beta) && beta >= 0))
    throw new DeepSftError("invalid-argument", `beta is ${beta}, expected a number that is not negative`);
  return smooth;
}
