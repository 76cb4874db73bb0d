// A scene in a part of the page: the camera's picture, the prints in it, and what is put on them.

import { Scene, WebGLRenderer } from "three";
import { CameraStream, openCamera } from "../camera/camera-stream.js";
import { DeepSft } from "../deepsft.js";
import { DeepSftError, asDeepSftError } from "../error.js";
import { Recording, pictureOf, recordingCanvas } from "../record/recording.js";
import { unknownTarget } from "../targets/target.js";
import { FrameBackground } from "../three/frame-background.js";
import { FrameCamera } from "../three/frame-camera.js";
import { hide } from "./print.js";
import { SceneSheet } from "./scene-sheet.js";
import { Screens } from "./screens.js";

/** @import { CameraOption } from "../camera/intrinsics.js" */
/** @import { Facing } from "../camera/request.js" */
/** @import { LoadOptions, PictureOptions } from "../deepsft.js" */
/** @import { FlatPrint, FlattenOptions } from "../frame-requests.js" */
/** @import { ImageInput } from "../frames/image-input.js" */
/** @import { TrackedFrame } from "../results/tracked-frame.js" */
/** @import { Target } from "../targets/target.js" */
/** @import { FrameSource, Session } from "../tracking/session.js" */
/** @import { Smoothing } from "../tracking/tracker-worker.js" */
/** @import { OwnScreens, ScreenContents, ScreenName } from "./screens.js" */

/**
 * @typedef {object} SceneOptions
 * @property {ImageInput} [picture] what is printed and looked for; more with {@link SceneView.addPicture}
 * @property {number} [widthMm] width of the print, without the paper's margins
 * @property {number} [heightMm] its height
 * @property {number} [aroundMm] diameter of the tin, bottle or tube that it goes around
 * @property {string} [name] of it, for people
 * @property {string | URL | null} [model] folder of a trained model, whose target is looked for too
 * @property {DeepSft} [sft] an engine of the page's own, which is not closed with the scene; its targets are looked for
 * @property {FrameSource} [source] what is shown in place of a camera: a video that plays, an open camera, or frames of one's own
 * @property {CameraOption} [camera] intrinsics of the source, where they are known
 * @property {Facing} [facing] which way the camera looks, default `environment`; the picture of one that looks at the person is mirrored
 * @property {string} [deviceId] a certain camera
 * @property {boolean | Smoothing} [smooth] as in `sft.follow`; default true
 * @property {boolean} [light] whether what stands on a print is lit as its paper is and casts a shadow on it; default true
 * @property {boolean} [sound] whether a button offers the sound of films that have one; default true
 * @property {OwnScreens | false} [screens] in place of those of the package; false for none
 * @property {Pick<LoadOptions, "device" | "baseUrl" | "onProgress">} [load] options of `DeepSft.load`
 * @property {AbortSignal} [signal] closes the scene
 */

/**
 * The events of a scene, by what their `detail` holds.
 *
 * @typedef {object} SceneEvents
 * @property {CustomEvent<{ sheet: SceneSheet, frame: TrackedFrame }>} found a print is found
 * @property {CustomEvent<{ sheet: SceneSheet, frame: TrackedFrame }>} lost it is found no longer
 * @property {CustomEvent<{ deltaS: number, frame: TrackedFrame }>} frame before each drawing: seconds since the last, and the newest frame
 * @property {CustomEvent<{ error: DeepSftError }>} error the camera, or what follows it, has failed; the screen offers to try again
 */

/** Canvas pixels per CSS pixel, at most: more cannot be seen and costs time. */
const MAX_DENSITY = 2;
/** Canvas pixels, at most, where the processor draws. */
const MAX_SOFTWARE_PIXELS = 330_000;
/** What programs call themselves that draw with the processor. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
/** After so long without a print the person is told what to do, milliseconds. */
const SCANNING_MS = 1500;
/** A page that was away does not make up for it, seconds. */
const MAX_DELTA_S = 0.1;

/** One for all: what is made anew holds on to the scene by its stack, and Chromium now and then on to the signal of a request that was ended. */
const CLOSED = new DeepSftError("closed", "The scene was closed.");

/** A scene that runs until it is closed. {@link start} makes it. */
export class SceneView extends EventTarget {
  #options;
  #ending = new AbortController();
  #element = document.createElement("div");
  #video = document.createElement("video");
  #screens;
  #background = new FrameBackground();
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
  /** @type {HTMLButtonElement | null} */
  #sound = null;

  /** The scene of three.js; the camera stands in its origin. A unit is a millimetre. */
  scene = new Scene();
  /** Sees what the video's camera sees. */
  camera = new FrameCamera();
  /** The camera that is open. @type {CameraStream | null} */
  stream = null;
  /** Why it stands still. @type {DeepSftError | null} */
  error = null;

  /**
   * Use {@link start}.
   *
   * @param {HTMLElement} container
   * @param {SceneOptions} options
   * @throws {DeepSftError} `browser-unsupported` without WebGL 2
   */
  constructor(container, options) {
    super();
    this.#options = options;
    // What a scene that failed has said here before.
    for (const left of container.querySelectorAll(":scope > [data-deepsft=failed]")) left.remove();
    const element = this.#element;
    container.append(element);
    const fills = container === document.body ? { position: "fixed", inset: "0" } : { position: "relative", width: "100%", height: "100%" };
    Object.assign(element.style, { ...fills, overflow: "hidden" });
    // A container without a height of its own takes that of the picture.
    if (element.clientHeight === 0) Object.assign(element.style, { height: "auto", aspectRatio: "4 / 3" });
    this.#screens = new Screens(element, options.screens ?? {});
    try {
      this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    } catch (cause) {
      const error = new DeepSftError("browser-unsupported", "This browser offers no WebGL 2, which the scene is drawn with.", { cause });
      this.#screens.show("failed", { error });
      throw error;
    }
    this.renderer.shadowMap.enabled = true;
    const gl = this.renderer.getContext();
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    /** Whether the processor does the drawing. */
    this.software = SOFTWARE.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    Object.assign(this.canvas.style, { display: "block", position: "absolute", width: "100%", height: "100%" });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "The camera's picture, with what is put into it");
    hide(this.#video);
    this.#video.setAttribute("aria-hidden", "true");
    element.append(this.#video, this.canvas);
    this.scene.add(this.#background);
    this.#resizing.observe(element);
    this.#resize();
    const { signal } = this.#ending;
    options.signal?.addEventListener("abort", () => this.close(), { signal });
    // Films that may not play before the person has tapped something.
    element.addEventListener("click", () => this.#playFilms(), { signal });
    document.addEventListener("visibilitychange", () => document.visibilityState === "visible" && this.#playFilms(), { signal });
  }

  /** The element that it is drawn on. */
  get canvas() {
    return this.renderer.domElement;
  }

  /** What is looked for. */
  get targets() {
    return this.#sft?.targets ?? [];
  }

  /** Whether it is over. */
  get closed() {
    return this.#ending.signal.aborted;
  }

  /**
   * @template {keyof SceneEvents} Name
   * @param {Name} name
   * @param {((event: SceneEvents[Name]) => void) | EventListenerObject | null} listener
   * @param {AddEventListenerOptions | boolean} [options]
   * @override
   */
  addEventListener(name, listener, options) {
    super.addEventListener(name, /** @type {EventListener | EventListenerObject | null} */ (listener), options);
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
   * @returns {Promise<SceneSheet>}
   * @throws {DeepSftError} as `sft.addPicture`
   */
  async addPicture(picture, options) {
    if (!this.#sft) throw new DeepSftError("closed", "The scene was closed, or has not started yet.");
    const target = await this.#sft.addPicture(picture, { signal: this.#ending.signal, ...options });
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
    const sheet = new SceneSheet(target, {
      ...{ light: this.#options.light ?? true, place: this.#element, signal: this.#ending.signal },
      flatten: (options) => this.#flatten(target, options),
    });
    this.#sheets.set(target, sheet);
    this.scene.add(sheet);
    return sheet;
  }

  /**
   * @param {Target} target
   * @param {FlattenOptions} options
   * @returns {Promise<FlatPrint | null>}
   */
  async #flatten(target, options) {
    if (!this.#frame || !this.#sft) return null;
    const { frame, camera } = this.#frame;
    if (!frame) return null;
    // The frame itself is let go as soon as there is a newer one.
    const copy = await createImageBitmap(frame);
    try {
      return await this.#sft.flatten(copy, { signal: this.#ending.signal, ...options, target, camera });
    } finally {
      copy.close();
    }
  }

  /**
   * What is seen now, not mirrored, as a PNG.
   *
   * @returns {Promise<Blob>}
   */
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
    for (const sheet of this.#sheets.values()) sheet.dispose();
    this.#background.dispose();
    // Browsers give a page a few contexts only, and collect the others late.
    this.renderer?.dispose();
    this.renderer?.forceContextLoss();
  }

  #closeEngine() {
    if (!this.#options.sft) this.#sft?.close();
    this.#sft = null;
  }

  /** @returns {Promise<FrameSource>} */
  async #open() {
    const { source, facing, deviceId } = this.#options;
    this.#show(source ? "loading" : "asking");
    const opened = source ?? (await openCamera(this.#video, { facing, deviceId, signal: this.#ending.signal }));
    this.#show("loading");
    if (!(opened instanceof CameraStream)) return opened;
    this.stream = opened;
    const mirror = () => (this.canvas.style.transform = opened.facing === "user" ? "scaleX(-1)" : "");
    mirror();
    opened.addEventListener("switched", mirror, { signal: this.#ending.signal });
    return opened;
  }

  /** @param {Promise<FrameSource>} opening */
  async #run(opening) {
    this.error = null;
    try {
      const source = await opening;
      if (this.closed || !this.#sft) return;
      const { camera, smooth = true } = this.#options;
      const onEstimate = this.targets.some(({ kind }) => kind === "model") ? this.#answer : undefined;
      const session = this.#sft.follow(source, { camera, smooth, software: this.software, onEstimate });
      this.#session = session;
      this.#foundAt = performance.now();
      session.addEventListener("interrupted", () => this.#show("interrupted"));
      for (const name of /** @type {const} */ (["found", "lost"]))
        session.addEventListener(name, ({ detail: { target, frame } }) => this.#tell(name, { sheet: this.sheet(target), frame }));
      cancelAnimationFrame(this.#request);
      this.#request = requestAnimationFrame(this.#loop);
      for await (const tracked of session) this.#take(tracked);
    } catch (error) {
      if (this.closed) return;
      if (!this.#options.source) this.stream?.close();
      this.stream = null;
      this.error = asDeepSftError(error);
      const again = () => void this.#run(this.#open());
      this.#show("failed", { error: this.error, retry: this.#options.source ? null : again });
      this.#tell("error", { error: this.error });
    }
  }

  /** @type {(estimate: import("../results/estimate.js").Estimate, frame: number) => void} */
  #answer = (estimate, frame) => {
    for (const [target, sheet] of this.#sheets) if (target.kind === "model") sheet.answer(estimate, frame);
    estimate.close();
  };

  /** @param {TrackedFrame} tracked */
  #take(tracked) {
    const now = performance.now();
    for (const { target } of tracked.targets) this.sheet(target).update(tracked, now);
    this.#playFilms();
    this.#background.show(tracked);
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
    // A processor that draws has better things to do than to draw the same once more.
    if (this.#isNew || (this.#frame && !this.software)) this.#draw(now);
  };

  /** @param {number} now milliseconds */
  #draw(now) {
    const frame = this.#frame;
    if (!frame || this.closed) return;
    this.#isNew = false;
    const deltaS = Math.min(MAX_DELTA_S, Math.max(0, (now - this.#drawnAt) / 1000 || 0));
    this.#drawnAt = now;
    this.#tell("frame", { deltaS, frame });
    for (const sheet of this.#sheets.values()) sheet.refreshPrint();
    this.#offerSound();
    this.camera.setIntrinsics(frame.camera, this.canvas);
    this.renderer.render(this.scene, this.camera);
    if (this.#recorded) this.#drawInto(this.#recorded.canvas);
  }

  /** What was just drawn, in the middle of a canvas. @param {HTMLCanvasElement} canvas */
  #drawInto(canvas) {
    const context = canvas.getContext("2d", { alpha: false });
    const { width, height } = this.canvas;
    const scale = Math.min(canvas.width / width, canvas.height / height);
    // The window may have turned since a recording began.
    context?.clearRect(0, 0, canvas.width, canvas.height);
    context?.drawImage(this.canvas, (canvas.width - scale * width) / 2, (canvas.height - scale * height) / 2, scale * width, scale * height);
    return canvas;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#element;
    const most = this.software ? Math.sqrt(MAX_SOFTWARE_PIXELS / Math.max(1, width * height)) : MAX_DENSITY;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, most));
    this.renderer.setSize(width, height, false);
    // At once: a canvas that has changed its size is empty.
    this.#draw(performance.now());
  }

  /** A button for the sound of films that have one: browsers allow it to taps alone. */
  #offerSound() {
    const films = [...this.#sheets.values()].flatMap(({ video }) => (video && hasSound(video) ? [video] : []));
    const isOffered = films.length > 0 && this.#options.sound !== false;
    if (!isOffered || this.#sound) return void (this.#sound && (this.#sound.hidden = !isOffered));
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "Sound";
    button.setAttribute("aria-pressed", "false");
    Object.assign(button.style, {
      ...{ position: "absolute", right: "16px", top: "16px", minHeight: "44px", padding: "0 16px", border: "0", borderRadius: "22px" },
      ...{ background: "rgb(16 19 22 / 0.75)", color: "#f2efe9", font: "16px system-ui, sans-serif" },
    });
    button.addEventListener("click", () => {
      const isOn = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(isOn));
      button.style.textDecoration = isOn ? "" : "line-through";
      for (const { video } of this.#sheets.values()) if (video) video.muted = !isOn;
    });
    button.style.textDecoration = "line-through";
    this.#sound = button;
    this.#element.append(button);
  }

  /**
   * @param {ScreenName | null} name
   * @param {Partial<ScreenContents>} [contents]
   */
  #show(name, contents) {
    if (!this.closed) this.#screens.show(name, contents);
  }

  /**
   * @param {keyof SceneEvents} name
   * @param {unknown} detail
   */
  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}

/** Whether a film has sound, where the browser tells; of the others only those that have played do. @param {HTMLVideoElement} video */
function hasSound(video) {
  const told = /** @type {{ mozHasAudio?: boolean, webkitAudioDecodedByteCount?: number, audioTracks?: { length: number } }} */ (/** @type {unknown} */ (video));
  return told.mozHasAudio ?? (told.audioTracks ? told.audioTracks.length > 0 : (told.webkitAudioDecodedByteCount ?? 1) > 0);
}
