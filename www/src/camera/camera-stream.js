// A camera that plays in a video element, and what interrupts it.

import { unlessAborted } from "../abort.js";
import { DeepSftError, asDeepSftError } from "../error.js";
import { keepCalibration, readCalibration } from "./calibration-store.js";
import { centredCamera, estimatedCamera } from "./intrinsics.js";
import { facingOf, requestCamera, requestFacing, requestStream, stopStream } from "./request.js";

/** @import { SourcedCamera } from "./intrinsics.js" */
/** @import { Facing, OpenCameraOptions } from "./request.js" */

/** So long after the page came back a camera that ended counts as one that the browser took away, milliseconds. */
const RETURN_MS = 5000;
/** A camera that delivers nothing for so long after an interruption is opened anew; one that is muted when it opens is interrupted, milliseconds. */
const FROZEN_MS = 3000;
/** A camera that is opened gives its first picture in this time, milliseconds. */
const FIRST_MS = 10_000;
/** Systems take a moment to free a camera that another program has had: it is asked for again after so long, milliseconds. */
const RETRIES_MS = [300, 1000, 3000];

/**
 * Opens a camera and plays it in a video element.
 *
 * @param {HTMLVideoElement} video must be in the document (iOS plays no other); it is set to play inline and muted
 * @param {OpenCameraOptions} [options]
 * @throws {DeepSftError} `camera-denied`, `camera-blocked`, `camera-not-found`, `camera-busy`, `camera-constraints`, `camera-unsupported`,
 *   `insecure-context`, `camera-lost`, `play-refused`, `closed` where something else was given to the video meanwhile
 */
export async function openCamera(video, { signal, ...wanted } = {}) {
  signal?.throwIfAborted();
  // A question to the person cannot be taken back; a camera that is allowed too late is freed at once.
  const camera = new CameraStream(video, await unlessAborted(requestStream(wanted), signal, stopStream));
  signal?.addEventListener("abort", () => camera.close(), { signal: camera.signal });
  try {
    await camera.start();
  } catch (error) {
    camera.close();
    signal?.throwIfAborted();
    throw error;
  }
  return camera;
}

/**
 * A camera there is; `facing` is "" where the browser does not tell which way it looks.
 *
 * @typedef {{ deviceId: string, label: string, facing: Facing | "" }} ListedCamera
 */

/**
 * The cameras there are. All three fields may be empty until a camera was allowed once.
 *
 * @returns {Promise<ListedCamera[]>}
 */
export async function listCameras() {
  const devices = (await navigator.mediaDevices?.enumerateDevices()) ?? [];
  const cameras = devices.filter(({ kind }) => kind === "videoinput");
  return cameras.map((device) => ({ deviceId: device.deviceId, label: device.label, facing: facingOf(device) }));
}

/**
 * A camera that plays. Events:
 *
 * - `interrupted`, when the system takes the camera away for a while: a phone call, a locked screen, another tab;
 * - `resumed`, when it plays again after that, opened anew if need be;
 * - `lost`, when it ended by itself (`error` then says why);
 * - `switched`, when another camera has taken its place by {@link CameraStream.switchTo};
 * - `resize`, when the picture's size changed because the device was turned, or another camera has another size; the intrinsics follow by themselves.
 */
export class CameraStream extends EventTarget {
  #video;
  #stream;
  #track;
  /** Ends all listening. */
  #listening = new AbortController();
  /** Ends listening to a track. */
  #trackListening = new AbortController();
  /** When the page was last seen to come back, milliseconds. */
  #returnedAt = -Infinity;
  /** @type {Promise<void> | null} */
  #resuming = null;
  /** @type {Promise<void> | null} */
  #switching = null;

  /**
   * Use {@link openCamera}.
   *
   * @param {HTMLVideoElement} video
   * @param {MediaStream} stream
   */
  constructor(video, stream) {
    super();
    this.#video = video;
    this.#stream = stream;
    [this.#track] = stream.getVideoTracks();
    /** @type {DeepSftError | null} why the stream ended by itself */
    this.error = null;
    /** Whether the system has taken the camera away for a while. */
    this.interrupted = false;
  }

  /** The element it plays in. */
  get video() {
    return this.#video;
  }

  /** Aborted when it was closed, or is lost, with why. */
  get signal() {
    return this.#listening.signal;
  }

  /** Plays the stream; called by {@link openCamera}. */
  async start() {
    const { signal } = this.#listening;
    const video = this.#video;
    video.playsInline = true;
    Object.assign(video, { muted: true, autoplay: true });
    video.addEventListener("resize", () => this.dispatchEvent(new Event("resize")), { signal });
    const returned = () => {
      if (document.visibilityState === "hidden") return;
      this.#returnedAt = performance.now();
      void this.#resume();
    };
    document.addEventListener("visibilitychange", returned, { signal });
    // The first one comes when the page has loaded, which may be after its camera has started.
    self.addEventListener("pageshow", ({ persisted }) => persisted && returned(), { signal });
    await this.#play(this.#stream);
  }

  /** Name of the camera. */
  get label() {
    return this.#track.label;
  }

  /** Which way it looks, where the browser tells. */
  get facing() {
    return this.#track.getSettings().facingMode ?? "";
  }

  /** Identifier of the camera, for {@link OpenCameraOptions}. */
  get deviceId() {
    return this.#track.getSettings().deviceId ?? "";
  }

  /**
   * The camera for images of a size, from its calibration in this browser or else estimated. A function that can be
   * passed as the `camera` option as it is: it is asked anew for each frame, so it follows a phone that is turned.
   *
   * @type {(width: number, height: number) => SourcedCamera}
   */
  intrinsics = (width, height) => {
    const known = readCalibration(this.#calibrationKey(width, height));
    if (!known) return estimatedCamera(width, height);
    const camera = centredCamera(width, height, known.focal, "calibrated");
    return known.spread === null ? camera : { ...camera, spread: known.spread };
  };

  /**
   * Keeps a focal length for this camera at this image size, in this browser, unless a surer one is kept already; null forgets it.
   *
   * @param {number} width pixels
   * @param {number} height pixels
   * @param {number | null} focal pixels
   * @param {number | null} [spread] its standard deviation, pixels; without one it takes the place of any other
   * @returns {boolean} whether it is what is kept now
   */
  calibrate(width, height, focal, spread = null) {
    return keepCalibration(this.#calibrationKey(width, height), focal === null ? null : { focal, spread });
  }

  /**
   * Plays another camera in the same video, so that what follows the video goes on. Switches called meanwhile happen in turn.
   * Interruptions from then on are about the new camera. One that does not open leaves the former one playing.
   *
   * @param {{ deviceId: string } | { facing: Facing }} wanted a certain camera, or one that looks this way
   * @returns {Promise<void>} once its first frame is there
   * @throws {DeepSftError} as {@link openCamera}; `camera-lost` when the former one does not open again either
   */
  switchTo(wanted) {
    const before = this.#switching ?? this.#resuming;
    const turn = (async () => {
      await before?.catch(() => undefined);
      await this.#switch(wanted);
    })();
    this.#switching = turn;
    const done = () => {
      if (this.#switching === turn) this.#switching = null;
      // The page may have been away meanwhile.
      void this.#resume();
    };
    turn.then(done, done);
    return turn;
  }

  /** Ends the stream and frees the camera. */
  close() {
    this.#listening.abort(new DeepSftError("closed", "The camera was closed."));
    this.#letGo();
    if (this.#video.srcObject === this.#stream) this.#video.srcObject = null;
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }

  /** @param {{ deviceId: string } | { facing: Facing }} wanted */
  async #switch(wanted) {
    const { signal } = this;
    signal.throwIfAborted();
    const openFormer = this.#again();
    // Phones open one camera at a time.
    this.#letGo();
    try {
      await this.#playNew(await ("deviceId" in wanted ? requestCamera(wanted.deviceId) : requestFacing(wanted.facing)));
    } catch (error) {
      signal.throwIfAborted();
      this.#letGo();
      try {
        await this.#playNew(await openFormer());
      } catch (cause) {
        signal.throwIfAborted();
        throw this.#lose(lostError(cause));
      }
      throw error;
    }
    this.dispatchEvent(new Event("switched"));
  }

  /** Ends the stream that plays, which is not told as its loss. */
  #letGo() {
    this.#trackListening.abort();
    stopStream(this.#stream);
  }

  /** Plays a stream in place of one that has ended, unless nobody wants it any more. @param {MediaStream} stream */
  async #playNew(stream) {
    if (this.signal.aborted) stopStream(stream);
    this.signal.throwIfAborted();
    await this.#play(stream);
  }

  /** What opens the camera that plays now once more. */
  #again() {
    const { deviceId } = this;
    const facing = this.facing === "user" ? "user" : "environment";
    return () => (deviceId === "" ? requestStream({ facing }) : requestCamera(deviceId));
  }

  /**
   * Plays a stream until its first frame is there. A camera that the system holds back meanwhile is interrupted.
   *
   * @param {MediaStream} stream
   */
  async #play(stream) {
    this.#trackListening.abort();
    this.#trackListening = new AbortController();
    const { signal } = this.#trackListening;
    this.#stream = stream;
    [this.#track] = stream.getVideoTracks();
    const track = this.#track;
    track.addEventListener("mute", () => this.#interrupt(), { signal });
    track.addEventListener("unmute", () => void this.#resume(), { signal });
    const video = this.#video;
    /** @type {ReturnType<typeof setTimeout>[]} */
    const clocks = [];
    const shown = new Promise((resolve, reject) => {
      track.addEventListener("ended", () => reject(this.#end()), { signal });
      signal.addEventListener("abort", () => reject(this.signal.reason));
      video.addEventListener("loadeddata", resolve, { once: true, signal });
      const muted = () => track.muted && (this.#interrupt(), resolve(undefined));
      const nothing = new DeepSftError("camera-busy", "The camera was opened, but gives no picture.");
      clocks.push(setTimeout(muted, FROZEN_MS), setTimeout(() => muted() || reject(nothing), FIRST_MS));
      const refused = (/** @type {unknown} */ error) => {
        const { name } = Object(error);
        if (video.srcObject !== stream) reject(new DeepSftError("closed", "Something else was given to the video to play.", { cause: error }));
        else if (name === "NotAllowedError") reject(new DeepSftError("play-refused", "The browser does not let the video play before the person has tapped something.", { cause: error }));
        // It plays by itself all the same, when it was only moved or paused for a moment.
        else if (name !== "AbortError") reject(asDeepSftError(error));
      };
      video.srcObject = stream;
      video.play().catch(refused);
    });
    await shown.finally(() => clocks.forEach(clearTimeout));
  }

  #interrupt() {
    if (this.interrupted) return;
    this.interrupted = true;
    this.dispatchEvent(new Event("interrupted"));
  }

  /**
   * The track has ended. A page that is away, or has just come back, waits for its return to open the camera anew; else it
   * was unplugged, or its permission withdrawn.
   */
  #end() {
    const ended = new DeepSftError("camera-busy", "The camera ended while it started.");
    // Whoever switches goes back to the former camera.
    if (this.#switching) return ended;
    const wasAway = document.visibilityState === "hidden" || performance.now() - this.#returnedAt < RETURN_MS;
    if (!wasAway) return this.#lose();
    this.#interrupt();
    void this.#resume();
    return ended;
  }

  /** Plays on after an interruption; one attempt at a time. */
  #resume() {
    if (document.visibilityState === "hidden" || this.#switching || this.signal.aborted) return null;
    const attempt = async () => {
      try {
        if (this.#track.readyState === "ended") await this.#reopen();
        // A call goes on: the track tells when it is over.
        if (this.#track.muted) return this.#interrupt();
        if (this.#video.paused) await this.#video.play().catch(() => undefined);
        if (!(await this.#showsFrames())) await this.#reopen();
      } catch (error) {
        if (!this.signal.aborted && document.visibilityState !== "hidden") this.#lose(lostError(error));
        return;
      }
      if (!this.interrupted || this.#track.muted || this.signal.aborted) return;
      this.interrupted = false;
      this.dispatchEvent(new Event("resumed"));
    };
    return (this.#resuming ??= attempt().finally(() => (this.#resuming = null)));
  }

  /** Opens the same camera once more, and again where another program is about to free it. */
  async #reopen() {
    this.#interrupt();
    const open = this.#again();
    stopStream(this.#stream);
    for (const waitMs of [...RETRIES_MS, null]) {
      try {
        return await this.#playNew(await open());
      } catch (error) {
        if (waitMs === null || asDeepSftError(error).code !== "camera-busy" || document.visibilityState === "hidden") throw error;
        stopStream(this.#stream);
        await new Promise((resolve) => setTimeout(resolve, waitMs));
        this.signal.throwIfAborted();
      }
    }
  }

  /** @returns {Promise<boolean>} whether a new frame comes within {@link FROZEN_MS} */
  #showsFrames() {
    const video = this.#video;
    if (!("requestVideoFrameCallback" in video)) return Promise.resolve(true);
    return new Promise((resolve) => {
      video.requestVideoFrameCallback(() => resolve(true));
      setTimeout(resolve, FROZEN_MS, false);
    });
  }

  #lose(error = lostError()) {
    this.error = error;
    this.#listening.abort(error);
    this.close();
    this.dispatchEvent(new Event("lost"));
    return error;
  }

  /**
   * Portrait and landscape of the same sensor share a calibration: the pixels are the same, turned.
   *
   * @param {number} width
   * @param {number} height
   */
  #calibrationKey(width, height) {
    return [this.label || this.deviceId, this.facing, Math.max(width, height), Math.min(width, height)].join("|");
  }
}

/**
 * Why a camera is lost.
 *
 * @param {unknown} [cause] why it did not open again
 */
function lostError(cause) {
  const reason = cause instanceof Error ? `it did not open again. ${cause.message}` : "it was unplugged, or its permission was withdrawn.";
  return new DeepSftError("camera-lost", `The camera went away: ${reason}`, { cause });
}
