// Asking the browser for a camera, and saying in words why there is none.

import { DeepSftError, asDeepSftError } from "../error.js";

/** @import { DeepSftErrorCode } from "../error.js" */

/** Which way a camera looks: away from the person, or at them. @typedef {"environment" | "user"} Facing */

/**
 * @typedef {object} OpenCameraOptions
 * @property {Facing} [facing] which way the camera should look; default "environment"
 * @property {string} [deviceId] a certain camera; where it is not there any more, one that looks the wanted way
 * @property {AbortSignal} [signal] closes the camera, or ends its opening, which then rejects with the signal's reason
 */

/** The picture to ask for. */
const PICTURE = { width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } };

/** @type {[DeepSftErrorCode, string]} */
const BUSY = ["camera-busy", "The camera is in use by another program or tab, or failed to start."];
/** What a refusal of `getUserMedia` means, by its name. @type {Readonly<Record<string, () => [DeepSftErrorCode, string]>>} */
const REFUSALS = {
  NotAllowedError() {
    const { featurePolicy } = /** @type {{ featurePolicy?: { allowsFeature(name: string): boolean } }} */ (document);
    // Where the browser tells of policies.
    return featurePolicy?.allowsFeature("camera") === false
      ? ["camera-blocked", 'The page may not use the camera: the page around this frame has to allow it (allow="camera"), or the server\'s Permissions-Policy.']
      : ["camera-denied", "The camera was not allowed. Allow it for this site in the settings of the browser, then try again."];
  },
  NotFoundError: () => ["camera-not-found", "No camera was found. Plug one in and try again."],
  NotReadableError: () => BUSY,
  AbortError: () => BUSY,
  OverconstrainedError: () => ["camera-constraints", "No camera here can deliver a usable picture."],
  SecurityError: noDevices,
};

/** Why a browser offers no cameras at all. @returns {[DeepSftErrorCode, string]} */
function noDevices() {
  return self.isSecureContext
    ? ["camera-unsupported", "This browser gives pages no camera. Apps that show pages often do not: open the page in a browser of its own."]
    : ["insecure-context", "Browsers give pages a camera only over https or from localhost."];
}

/** @param {MediaStream} stream */
export function stopStream(stream) {
  for (const track of stream.getTracks()) track.stop();
}

/**
 * A stream of the first wish that can be met.
 *
 * @param {MediaTrackConstraints[]} wishes from the best to the least that is any use
 * @throws {DeepSftError} `camera-denied`, `camera-blocked`, `camera-not-found`, `camera-busy`, `camera-constraints`, `camera-unsupported`, `insecure-context`
 */
async function requestFirst(wishes) {
  const devices = navigator.mediaDevices;
  if (!devices?.getUserMedia) throw new DeepSftError(...noDevices());
  /** @type {unknown} */
  let refusal;
  for (const video of wishes) {
    try {
      return await devices.getUserMedia({ video, audio: false });
    } catch (error) {
      refusal = error;
      if (Object(error).name !== "OverconstrainedError") break;
    }
  }
  const { name, message } = Object(refusal);
  // A camera that "does not fit" may be none at all: WebKit says so.
  const known = name === "OverconstrainedError" ? await devices.enumerateDevices().catch(() => null) : null;
  const isMissing = known?.every(({ kind }) => kind !== "videoinput");
  const [code, words] = REFUSALS[isMissing ? "NotFoundError" : name]?.() ?? ["internal", `The camera failed: ${message ?? refusal}`];
  throw new DeepSftError(code, words, { cause: refusal });
}

/**
 * A stream of the camera that is wanted, or, where no camera meets the wishes, of any.
 *
 * @param {OpenCameraOptions} options
 * @throws {DeepSftError} `camera-denied`, `camera-blocked`, `camera-not-found`, `camera-busy`, `camera-constraints`, `camera-unsupported`, `insecure-context`
 */
export async function requestStream({ facing = "environment", deviceId }) {
  if (deviceId === undefined) return requestFacing(facing, "ideal");
  return requestCamera(deviceId).catch((error) => {
    // It may not be there any more.
    if (!["camera-constraints", "camera-not-found"].includes(asDeepSftError(error).code)) throw error;
    return requestFacing(facing, "ideal");
  });
}

/**
 * A stream of this camera and no other.
 *
 * @param {string} deviceId
 * @throws {DeepSftError} as {@link requestStream}
 */
export function requestCamera(deviceId) {
  const which = { deviceId: { exact: deviceId } };
  return requestFirst([{ ...which, ...PICTURE }, which]);
}

/**
 * A stream of a camera that looks this way; of several back cameras the main one, where the browser tells them apart.
 *
 * @param {Facing} facing
 * @param {"exact" | "ideal"} [strictness] whether one that looks another way will not do
 * @throws {DeepSftError} as {@link requestStream}
 */
export async function requestFacing(facing, strictness = "exact") {
  const which = { facingMode: { [strictness]: facing } };
  const stream = await requestFirst([{ ...which, ...PICTURE }, which, ...(strictness === "ideal" ? [{}] : [])]);
  if (facing !== "environment") return stream;
  const current = stream.getVideoTracks()[0].getSettings().deviceId;
  const main = mainBackCamera(await navigator.mediaDevices.enumerateDevices().catch(() => []), current);
  if (main === null || current === undefined) return stream;
  // Phones open one camera at a time; the first one comes back when the main one does not open.
  stopStream(stream);
  return requestCamera(main).catch(() => requestCamera(current));
}

/**
 * Which way a camera looks: as its capabilities say, else as Chrome on Android and an English Safari name it.
 *
 * @param {MediaDeviceInfo} device
 * @returns {Facing | ""}
 */
export function facingOf(device) {
  const { facingMode: [told] = [] } = capabilitiesOf(device);
  if (told === "environment" || told === "user") return told;
  if (/\bback\b/i.test(device.label)) return "environment";
  return /\bfront\b/i.test(device.label) ? "user" : "";
}

/** What a camera can do; nothing where the browser does not tell. @param {MediaDeviceInfo} device */
function capabilitiesOf(device) {
  return /** @type {Partial<InputDeviceInfo>} */ (device).getCapabilities?.() ?? {};
}

/** Names of lenses that are not the main one, and of cameras that change between lenses, as Apple and others call them in English. */
const OTHER_LENS = /\b(ultra|wide|tele|telephoto|macro|zoom|depth|infrared|dual|triple|desk)\b/i;

/**
 * The main back camera; null when that is open already, or the browser does not tell enough of its cameras. Android numbers the main one of
 * each side first, whatever the pixels of the others; an iPhone's "Back Camera" is one lens, and its "Back Triple Camera" changes between
 * three, which no calibration survives. Of those whose names say nothing it is the one with the most pixels.
 *
 * @param {MediaDeviceInfo[]} devices
 * @param {string | undefined} current
 */
function mainBackCamera(devices, current) {
  const backs = devices.filter((device) => device.kind === "videoinput" && facingOf(device) === "environment").map((device) => {
    const { width, height } = capabilitiesOf(device);
    const number = /\bcamera2? (\d+)\b|\bback:(\d+)/i.exec(device.label);
    return {
      deviceId: device.deviceId,
      number: Number(number?.[1] ?? number?.[2] ?? 0),
      isOther: OTHER_LENS.test(device.label),
      pixels: (width?.max ?? 0) * (height?.max ?? 0),
    };
  });
  /** @type {(a: typeof backs[0], b: typeof backs[0]) => number} below 0 where `a` is rather the main one */
  const compare = (a, b) => Number(a.isOther) - Number(b.isOther) || a.number - b.number || b.pixels - a.pixels;
  const [main] = [...backs].sort(compare);
  const open = backs.find(({ deviceId }) => deviceId === current);
  const isKnown = main !== undefined && (open !== undefined || main.pixels > 0);
  return isKnown && (open === undefined || compare(main, open) < 0) ? main.deviceId : null;
}
