// The camera: asking for it, keeping it, and saying in words why it is not there.

import { readCalibration, writeCalibration } from "./calibration-store.js";
import { DeepSftError } from "../error.js";
import { centredCamera, estimatedCamera } from "./intrinsics.js";

/** @import { SourcedCamera } from "./intrinsics.js" */

/**
 * @typedef {object} OpenCameraOptions
 * @property {"environment" | "user"} [facing] which way the camera should look; default "environment"
 * @property {string} [deviceId] a certain camera
 */

/** Names of the main back camera where a phone has several; the others are wide or zoom lenses. */
const MAIN_BACK_CAMERA = /^back camera$|camera2? 0, facing back/i;

/**
 * What to ask for, from the wish to the least that is any use.
 *
 * @param {OpenCameraOptions} options
 * @returns {MediaTrackConstraints[]}
 */
function constraintSteps({ facing = "environment", deviceId }) {
  const which = deviceId === undefined ? { facingMode: { ideal: facing } } : { deviceId: { exact: deviceId } };
  return [{ ...which, width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } }, which, {}];
}

/**
 * A browser's refusal as an error with a code.
 *
 * @param {unknown} error
 * @returns {DeepSftError}
 */
export function cameraError(error) {
  const name = error instanceof Error || error instanceof DOMException ? error.name : "";
  const explained = (/** @type {import("../error.js").DeepSftErrorCode} */ code, /** @type {string} */ message) =>
    new DeepSftError(code, message, { cause: error });
  switch (name) {
    case "NotAllowedError":
      return explained(
        "camera-denied",
        "The camera was not allowed. Allow it for this page in the browser's address bar, then try again.",
      );
    case "NotFoundError":
      return explained("camera-not-found", "No camera was found. Plug one in, or use the clip or an image.");
    case "NotReadableError":
    case "AbortError":
      return explained("camera-busy", "The camera is in use by another program or tab, or failed to start.");
    case "OverconstrainedError":
      return explained("camera-constraints", "No camera here can deliver a usable picture.");
    case "SecurityError":
      return explained("insecure-context", "Browsers give pages a camera only over https or from localhost.");
    default:
      return explained("internal", `The camera failed: ${error instanceof Error ? error.message : error}`);
  }
}

/**
 * getUserMedia with constraints that relax in steps.
 *
 * @param {MediaDevices} devices
 * @param {OpenCameraOptions} options
 * @returns {Promise<MediaStream>}
 */
async function requestStream(devices, options) {
  /** @type {unknown} */
  let refusal;
  for (const video of constraintSteps(options)) {
    try {
      return await devices.getUserMedia({ video, audio: false });
    } catch (error) {
      refusal = error;
      if (!(error instanceof Error || error instanceof DOMException) || error.name !== "OverconstrainedError") break;
    }
  }
  throw cameraError(refusal);
}

/** @param {MediaStream} stream */
function stopStream(stream) {
  for (const track of stream.getTracks()) track.stop();
}

/**
 * The main back camera instead of a wide or zoom one, where labels tell them apart.
 *
 * @param {MediaDevices} devices
 * @param {MediaStream} stream
 * @returns {Promise<MediaStream>}
 */
async function preferMainCamera(devices, stream) {
  const [track] = stream.getVideoTracks();
  if (MAIN_BACK_CAMERA.test(track.label)) return stream;
  const main = (await devices.enumerateDevices()).find(
    ({ kind, label }) => kind === "videoinput" && MAIN_BACK_CAMERA.test(label),
  );
  if (!main) return stream;
  // Phones open one camera at a time.
  stopStream(stream);
  return requestStream(devices, { deviceId: main.deviceId });
}

/**
 * Opens a camera and plays it in a video element.
 *
 * @param {HTMLVideoElement} video must be in the document (iOS plays no other); it is set to play inline and muted
 * @param {OpenCameraOptions} [options]
 * @returns {Promise<CameraStream>}
 * @throws {DeepSftError} `camera-denied`, `camera-not-found`, `camera-busy`, `camera-constraints`, `insecure-context`, `camera-lost`
 */
export async function openCamera(video, options = {}) {
  const devices = navigator.mediaDevices;
  if (!devices?.getUserMedia) {
    throw new DeepSftError("insecure-context", "Browsers give pages a camera only over https or from localhost.");
  }
  let stream = await requestStream(devices, options);
  if (options.deviceId === undefined && (options.facing ?? "environment") === "environment") {
    stream = await preferMainCamera(devices, stream);
  }
  const camera = new CameraStream(video, stream);
  try {
    await camera.start();
  } catch (error) {
    camera.stop();
    throw error instanceof DeepSftError ? error : cameraError(error);
  }
  return camera;
}

/**
 * The cameras there are. Labels are empty until a camera was allowed once.
 *
 * @returns {Promise<{ deviceId: string, label: string }[]>}
 */
export async function listCameras() {
  const devices = (await navigator.mediaDevices?.enumerateDevices()) ?? [];
  return devices.filter(({ kind }) => kind === "videoinput").map(({ deviceId, label }) => ({ deviceId, label }));
}

/**
 * A camera that plays. Events: `lost`, when the stream ended by itself (`error` then says why), and `resize`, when the
 * picture's size changed because the device was turned; the intrinsics follow by themselves.
 */
export class CameraStream extends EventTarget {
  #video;
  #stream;
  #track;

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
  }

  /** Plays the stream; called by {@link openCamera}. */
  async start() {
    const video = this.#video;
    video.playsInline = true;
    video.muted = true;
    video.autoplay = true;
    const lost = new Promise((_, reject) =>
      this.#track.addEventListener("ended", () => reject(this.#lose()), { once: true }),
    );
    lost.catch(() => undefined);
    video.addEventListener("resize", this.#onResize);
    video.srcObject = this.#stream;
    const first = new Promise((resolve) => video.addEventListener("loadeddata", resolve, { once: true }));
    await Promise.race([Promise.all([video.play(), first]), lost]);
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
    const focal = readCalibration(this.#calibrationKey(width, height));
    return focal === null ? estimatedCamera(width, height) : centredCamera(width, height, focal, "calibrated");
  };

  /**
   * Keeps a focal length for this camera at this image size, in this browser; null forgets it.
   *
   * @param {number} width pixels
   * @param {number} height pixels
   * @param {number | null} focal pixels
   */
  calibrate(width, height, focal) {
    writeCalibration(this.#calibrationKey(width, height), focal);
  }

  /** Ends the stream and frees the camera. */
  stop() {
    this.#video.removeEventListener("resize", this.#onResize);
    stopStream(this.#stream);
    if (this.#video.srcObject === this.#stream) this.#video.srcObject = null;
  }

  #onResize = () => this.dispatchEvent(new Event("resize"));

  #lose() {
    this.error = new DeepSftError(
      "camera-lost",
      "The camera went away: it was unplugged, or its permission was withdrawn.",
    );
    this.stop();
    this.dispatchEvent(new Event("lost"));
    return this.error;
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
