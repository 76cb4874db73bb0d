// A scene in a part of the page: the camera's picture, the prints in it, and what is put on them.

import { Scene, WebGLRenderer } from "three";
import { Announcer } from "../announcer.js";
import { CameraStream, openCamera } from "../camera/camera-stream.js";
import { DeepSft } from "../deepsft.js";
import { DeepSftError, asDeepSftError } from "../error.js";
import { Recording, pictureOf, recordingCanvas } from "../record/recording.js";
import { TrackedFrame, TrackedTarget } from "../results/tracked-frame.js";
import { unknownTarget } from "../targets/target.js";
import { FrameCamera } from "../three/frame-camera.js";
import { drawsInSoftware, Pace } from "./drawing-speed.js";
import { hide } from "./print.js";
import { SceneSheet } from "./scene-sheet.js";
import { SceneLayers } from "./scene-layers.js";
import { Screens } from "./screens.js";
import { SoundButton } from "./sound-button.js";

/** @import { Estimate, FrameSource, ImageInput, PictureOptions, Session, Target } from "../index.js" */
/** @import { SceneEvents, SceneOptions } from "./index.js" */
/** @import { ScreenContents, ScreenName } from "./screens.js" */

/** After so long without a print the person is told what to do, milliseconds. */
const SCANNING_MS = 1500;
/** A page that was away does not make up for it, seconds. */
const MAX_DELTA_S = 0.1;

/** One for all: what is made anew holds on to the scene by its stack, and Chromium now and then on to the signal of a request that was ended. */
const CLOSED = new DeepSftError("closed", "The scene was closed.");

/** A scene that runs until it is closed. {@link start} makes it. @extends {Announcer<SceneEvents>} */
export class SceneView extends Announcer {
  #options;
  #ending = new AbortController();
  #element = document.createElement("div");
  #video = document.createElement("video");
  #screens;
  #layers;
  #pace = new Pace();
  #resizing = new ResizeObserver(() => this.#resize());
  /** @type {Map<Target, SceneSheet>} */
  #sheets = new Map();
  /** @type {Session | null} */
  #session = null;
  /** @type {DeepSft | null} */
  #sft = null;
  /** The newest frame, and whether it was not drawn yet. @type {TrackedFrame | null} */
  #frame = null;
  #isNew = false;
  #foundAt = 0;
  #drawnAt = Number.NaN;
  #request = 0;
  /** @type {{ canvas: HTMLCanvasElement, recording: Recording } | null} */
  #recorded = null;
  #sound;

  /** The scene of three.js; the camera stands in its origin. A unit is a millimetre. */
  scene;
  /** Sees what the video's camera sees. @type {FrameCamera} */
  camera;
  /** The camera that is open. @type {CameraStream | null} */
  stream = null;
  /** Why it stands still. @type {DeepSftError | null} */
  error = null;
  /** Time the last drawing took, milliseconds. */
  drawMs = 0;

  /**
   * Use {@link start}.
   *
   * @param {HTMLElement} container
   * @param {SceneOptions} options
   * @throws {DeepSftError} `browser-unsupported` without WebGL 2
   */
  constructor(container, options) {
    super();
    this.#options = { ...options, targets: options.targets && [...options.targets] };
    this.camera = new FrameCamera({ fit: options.fit });
    const { host } = options;
    this.scene = host?.scene ?? new Scene();
    // What a scene that failed has said here before.
    for (const left of container.querySelectorAll(":scope > [data-deepsft=failed]")) left.remove();
    const element = this.#element;
    container.append(element);
    const fills = container === document.body ? { position: "fixed", inset: "0" } : { position: "relative", width: "100%", height: "100%" };
    Object.assign(element.style, { ...fills, overflow: "hidden" });
    // Over a canvas that the page has laid there, and through to it.
    if (host) Object.assign(element.style, { position: "absolute", inset: "0", pointerEvents: "none" });
    // A container without a height of its own takes that of the picture.
    else if (element.clientHeight === 0) Object.assign(element.style, { height: "auto", aspectRatio: "4 / 3" });
    this.#screens = new Screens(element, options.screens ?? {});
    try {
      /** Whether the processor does the drawing. */
      this.software = drawsInSoftware();
      this.renderer = host?.renderer ?? new WebGLRenderer({ alpha: true, antialias: !this.software, powerPreference: "high-performance" });
    } catch (cause) {
      const error = new DeepSftError("browser-unsupported", "This browser offers no WebGL 2, which the scene is drawn with.", { cause });
      this.#screens.show("failed", { error });
      throw error;
    }
    this.renderer.shadowMap.enabled = true;
    this.#layers = new SceneLayers(this, host !== undefined);
    hide(this.#video);
    element.append(this.#video, this.#layers.element);
    this.#sound = options.sound === false ? null : new SoundButton(element);
    this.#resizing.observe(element);
    this.#resize();
    const { signal } = this.#ending;
    options.signal?.addEventListener("abort", () => this.close(), { signal });
    // Films that may not play before the person has tapped something.
    container.addEventListener("click", () => this.#playFilms(), { signal });
    document.addEventListener("visibilitychange", () => document.visibilityState === "visible" && this.#playFilms(), { signal });
  }

  /** The element that it is drawn on. */
  get canvas() {
    return this.renderer.domElement;
  }

  /** What is looked for. */
  get targets() {
    return this.#options.targets ?? this.#sft?.targets ?? [];
  }

  /** Whether it is over. */
  get closed() {
    return this.#ending.signal.aborted;
  }

  /** Loads what is looked for, while the person is asked for the camera; called by {@link start}. */
  async load() {
    const { signal } = this.#ending;
    const { picture, widthMm, heightMm, aroundMm, name, model, load } = this.#options;
    const opening = this.#open();
    opening.catch(() => undefined);
    const sft = this.#options.sft ?? (await DeepSft.load(model, { ...load, signal }));
    this.#sft = sft;
    if (signal.aborted) this.#closeEngine();
    signal.throwIfAborted();
    if (picture !== undefined) await this.addPicture(picture, { widthMm, heightMm, aroundMm, name });
    // What fails is told once whoever started it listens.
    setTimeout(() => void this.#run(opening));
  }

  /**
   * Looks for another picture too.
   *
   * @param {ImageInput} picture
   * @param {PictureOptions} [options]
   * @throws {DeepSftError} as `sft.addPicture`
   */
  async addPicture(picture, options) {
    if (!this.#sft) throw new DeepSftError("closed", "The scene was closed, or has not started yet.");
    const target = await this.#sft.addPicture(picture, { signal: this.#ending.signal, ...options });
    if (this.#options.targets) {
      this.#options.targets.push(target);
      this.#session?.addTarget(target);
    }
    return this.sheet(target);
  }

  /**
   * A print in the scene.
   *
   * @param {Target} [target] the first when absent
   * @returns {SceneSheet} the same for the same target
   * @throws {DeepSftError} `target-unknown`
   */
  sheet(target = this.targets[0]) {
    if (!target || !this.targets.includes(target)) throw unknownTarget("The scene has no such print: give it a picture.");
    const known = this.#sheets.get(target);
    if (known) return known;
    const { signal } = this.#ending;
    const sheet = new SceneSheet(target, {
      ...{ light: this.#options.light ?? true, place: this.#element, signal },
      flatten: async (options) => {
        const { frame, camera } = this.#frame ?? {};
        if (!frame || !this.#sft) return null;
        // The frame itself is let go as soon as there is a newer one.
        const copy = await createImageBitmap(frame);
        return this.#sft.flatten(copy, { signal, ...options, target, camera }).finally(() => copy.close());
      },
    });
    this.#sheets.set(target, sheet);
    this.scene.add(sheet);
    return sheet;
  }

  /** What is seen now, not mirrored, as a PNG. */
  shot() {
    this.#draw(performance.now());
    return pictureOf(this.#drawInto(recordingCanvas(this.#element)));
  }

  /**
   * Records what is seen from now on, for two minutes at most.
   *
   * @returns {Recording} `await recording.stop()` is the video
   * @throws {DeepSftError} `browser-unsupported`
   */
  record() {
    this.#draw(performance.now());
    const canvas = this.#drawInto(recordingCanvas(this.#element));
    const recording = new Recording(canvas);
    const recorded = (this.#recorded = { canvas, recording });
    const ended = () => this.#recorded === recorded && (this.#recorded = null);
    recording.finished.then(ended, ended);
    return recording;
  }

  /** Draws anew what a page has changed: the scene draws by itself what moves with the camera's picture. */
  refresh() {
    this.#isNew = true;
  }

  /** Whether it is to be drawn: a processor that draws has better things to do than to draw the same once more. */
  get due() {
    return this.#isNew || (this.#frame !== null && !this.software);
  }

  /** Takes over the newest frame, and fires `frame`: a {@link SceneHost} calls it before each drawing. @param {number} [now] milliseconds */
  prepare(now = performance.now()) {
    const frame = this.#frame;
    if (!frame || this.closed) return;
    this.#isNew = false;
    const deltaS = Math.min(MAX_DELTA_S, Math.max(0, (now - this.#drawnAt) / 1000 || 0));
    this.#drawnAt = now;
    this.tell("frame", { deltaS, frame });
    for (const sheet of this.#sheets.values()) sheet.refreshPrint();
    this.#sound?.offer([...this.#sheets.values()].flatMap(({ video }) => video ?? []));
    this.camera.setIntrinsics(frame.camera, this.#layers.page);
  }

  /** Records what was just drawn; a {@link SceneHost} calls it after each drawing. */
  drawn() {
    if (this.#recorded) this.#drawInto(this.#recorded.canvas);
  }

  /** Ends it, frees the camera, and takes it out of the page. Models that were added stay the page's. */
  close() {
    this.#end();
    this.#element.remove();
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }

  /** Ends it, and leaves why in the page; called by {@link start}. @param {unknown} error */
  fail(error) {
    this.#end();
    this.#element.replaceChildren();
    this.#screens.show("failed", { error: asDeepSftError(error) });
  }

  #end() {
    if (this.closed) return;
    this.#recorded?.recording.stop().catch(() => undefined);
    this.#ending.abort(CLOSED);
    cancelAnimationFrame(this.#request);
    this.#resizing.disconnect();
    this.#screens.show(null);
    this.#session?.close();
    this.#closeEngine();
    for (const sheet of this.#sheets.values()) sheet.removeFromParent().dispose();
    this.#layers?.dispose();
    if (this.#options.host) return;
    // Browsers give a page a few contexts only, and collect the others late.
    this.renderer?.dispose();
    this.renderer?.forceContextLoss();
  }

  #closeEngine() {
    if (!this.#options.sft) this.#sft?.close();
    this.#sft = null;
  }

  /** @returns {Promise<FrameSource | null>} null for a photograph */
  async #open() {
    const { source, photograph, facing, deviceId } = this.#options;
    this.#show(source || photograph ? "loading" : "asking");
    if (photograph) return null;
    const opened = source ?? (await openCamera(this.#video, { facing, deviceId, signal: this.#ending.signal }));
    this.#show("loading");
    if (!(opened instanceof CameraStream)) return opened;
    this.stream = opened;
    const mirror = () => this.#layers.mirror(opened.facing === "user");
    mirror();
    opened.addEventListener("switched", mirror, { signal: this.#ending.signal });
    return opened;
  }

  /** @param {Promise<FrameSource | null>} opening */
  async #run(opening) {
    this.error = null;
    try {
      const source = await opening;
      if (this.closed || !this.#sft) return;
      const { targets, camera, smooth = true } = this.#options;
      cancelAnimationFrame(this.#request);
      if (!this.#options.host) this.#request = requestAnimationFrame(this.#loop);
      if (source === null) return await this.#lookAt(this.#sft);
      const isAsked = this.#options.onEstimate !== undefined || this.targets.some(({ kind }) => kind === "model");
      const answer = (/** @type {Estimate} */ estimate, /** @type {number} */ frame) => (this.#tellSheets(estimate, frame), estimate.close());
      const onEstimate = isAsked ? answer : undefined;
      const session = this.#sft.follow(source, { targets, camera, smooth, software: this.software, onEstimate });
      this.#session = session;
      this.#foundAt = performance.now();
      session.addEventListener("interrupted", () => this.#show("interrupted"));
      for (const name of /** @type {const} */ (["found", "lost"]))
        session.addEventListener(name, ({ detail: { target, frame } }) => this.tell(name, { sheet: this.sheet(target), frame }));
      for await (const tracked of session) this.#take(tracked);
    } catch (error) {
      if (this.closed) return;
      if (!this.#options.source) this.stream?.close();
      this.stream = null;
      this.error = asDeepSftError(error);
      const again = () => void this.#run(this.#open());
      this.#show("failed", { error: this.error, retry: this.#options.source ? null : again });
      this.tell("error", { error: this.error });
    }
  }

  /** @param {Estimate} estimate @param {number} frame its number */
  #tellSheets(estimate, frame) {
    for (const [target, sheet] of this.#sheets) if (target.kind === "model") sheet.answer(estimate, frame);
    this.#options.onEstimate?.(estimate, frame);
  }

  /** Shows the photograph, as if it were the one frame of a video. @param {DeepSft} sft */
  async #lookAt(sft) {
    const { photograph, camera } = this.#options;
    const [target] = this.targets;
    const { signal } = this.#ending;
    const estimate = await sft.estimate(/** @type {ImageInput} */ (photograph), { target, camera, signal });
    const mesh = await estimate.completeMesh();
    const { confidence, times } = estimate;
    const frame = estimate.frame ?? (await createImageBitmap(/** @type {ImageData} */ (photograph)));
    const contents = { number: 0, timeMs: 0, camera: estimate.camera, times: { ...times, trackMs: times.fitMs }, networkFps: 0, frame };
    const tracked = new TrackedFrame({ ...contents, targets: [new TrackedTarget({ target, mesh, held: false, correlation: confidence, iterations: 0 })] });
    if (this.closed) return void (estimate.close(), tracked.close());
    this.#take(tracked);
    this.#tellSheets(estimate, 0);
    // The scene closes the frame.
    estimate.frame = null;
    estimate.close();
    // What covers it is known by now.
    this.#take(tracked);
    if (mesh) this.tell("found", { sheet: this.sheet(target), frame: tracked });
  }

  /** @param {TrackedFrame} tracked */
  #take(tracked) {
    const now = performance.now();
    for (const { target } of tracked.targets) this.sheet(target).update(tracked, now);
    this.#playFilms();
    this.#layers.background.show(tracked);
    this.#frame = tracked;
    this.#isNew = true;
    const isFound = tracked.targets.length === 0 || tracked.targets.some(({ found }) => found);
    if (isFound) this.#foundAt = now;
    if (this.stream?.interrupted) return;
    if (isFound) this.#show(null);
    // For a moment people need not be told.
    else if (now - this.#foundAt > SCANNING_MS) this.#show("scanning", { targets: this.targets });
  }

  #playFilms() {
    for (const sheet of this.#sheets.values()) sheet.playFilm();
  }

  /** @param {number} now */
  #loop = (now) => {
    this.#request = requestAnimationFrame(this.#loop);
    if (!this.software && this.#frame && this.#pace.isSlow(now)) {
      this.software = true;
      this.#resize();
    }
    if (this.due) this.#draw(now);
  };

  /** @param {number} now milliseconds */
  #draw(now) {
    const frame = this.#frame;
    if (!frame || this.closed) return;
    this.prepare(now);
    const began = performance.now();
    this.#layers.draw(frame);
    this.drawMs = performance.now() - began;
    this.drawn();
  }

  /** What was just drawn. @param {HTMLCanvasElement} canvas */
  #drawInto(canvas) {
    return this.#layers.drawInto(canvas, getComputedStyle(this.#element.parentElement ?? this.#element).backgroundColor);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#element;
    this.#layers.page = { width, height };
    // At once: a canvas that has changed its size is empty.
    if (!this.#options.host) this.#draw(performance.now());
  }

  /**
   * @param {ScreenName | null} name
   * @param {Partial<ScreenContents>} [contents]
   */
  #show(name, contents) {
    if (!this.closed) this.#screens.show(name, contents);
  }
}
