// The estimator as pages use it.

import { folderOf, isAddress } from "./address.js";
import { bundleFiles, fetchBundle } from "./engine/bundle.js";
import { compileEngine } from "./engine/engine-worker.js";
import { LastingEngine, closedError, startEngine } from "./engine/lasting-engine.js";
import { requireBrowser } from "./engine/requirements.js";
import { WorkerCalls } from "./engine/worker-calls.js";
import { DeepSftError } from "./error.js";
import { FrameRequests } from "./frame-requests.js";
import { Scan, scanFiles } from "./targets/scan.js";
import { isSamePicture, pictureSource, templateSource, unusable } from "./targets/target-source.js";
import { MODEL_TARGET, Target, unknownTarget } from "./targets/target.js";
import { Session } from "./tracking/session.js";

/** @import { CameraOption, Estimate, EstimateOptions, FlatPrint, FlattenOptions, FrameSource, ImageInput, LoadProgress, ScanInput, Smoothing, TargetKind, TemplateInput } from "./index.js" */
/** @import { ModelInput } from "./engine/bundle.js" */
/** @import { TargetSource } from "./targets/target-source.js" */
/** @import { Question } from "./tracking/session.js" */

/**
 * @typedef {object} LoadOptions
 * @property {"auto" | "webgpu" | "cpu"} [device] `auto` (the default) takes WebGPU when a real GPU offers what the engine
 *   needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
 * @property {(progress: LoadProgress) => void} [onProgress]
 * @property {boolean} [keep] whether this browser keeps the model's files, in its Cache storage by their SHA-256, so that the next visit
 *   asks for `model.json` alone; default true. Where there is no such storage, or no room, they are fetched each time.
 * @property {HeadersInit} [headers] of the requests for the model's files, as of a server that asks who it is
 * @property {AbortSignal} [signal] stops loading; the promise then rejects with the signal's reason
 * @property {string | URL} [baseUrl] address of a copy of this package's folder `dist`, whose worker and engine are taken, where a bundler does
 *   not find them
 * @property {number} [timeoutMs] so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
 *   hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
 */

/**
 * @typedef {object} PictureOptions
 * @property {number} [widthMm] width of the print, without the paper's margins; 5 to 20,000. Without it lengths are counted in that width,
 *   and the target's `unit` is `width`.
 * @property {number} [heightMm] its height; by the picture's sides when absent
 * @property {number} [aroundMm] diameter of the tin, bottle, mug or tube that the print goes around; it needs `widthMm`. A print longer
 *   than one turn covers its own end. When absent the print lies flat at rest.
 * @property {number} [copies] how many copies of the print `follow` follows at once, up to 16; each takes the finders about as long again.
 *   Default 1
 * @property {string} [name] for people; the file's own for a File and an address
 * @property {AbortSignal} [signal] rejects with its reason, and no target is added
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

const WASM_NAME = "deepsft_web_bg.wasm";
/** Bundlers know only this form. */
const WASM_URL = new URL("../dist/deepsft_web_bg.wasm", import.meta.url);

/** Shape from template on a worker of its own. */
export class DeepSft {
  #engine;
  #requests;
  /** By number. @type {Map<number, Target>} */
  #targets = new Map();
  #lastTarget = MODEL_TARGET;
  /** Those that run, and whether they follow all there is. @type {Map<Session, boolean>} */
  #sessions = new Map();

  /**
   * Use {@link DeepSft.load}.
   *
   * @param {LastingEngine} engine
   */
  constructor(engine) {
    this.#engine = engine;
    this.#requests = new FrameRequests(engine, (target) => this.#chosen(target));
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
  estimate(image, options = {}) {
    return this.#requests.estimate(image, options);
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
  flatten(image, options = {}) {
    return this.#requests.flatten(image, options);
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
      find: (/** @type {Question} */ question) => this.#requests.find(question, options.onEstimate !== undefined),
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
