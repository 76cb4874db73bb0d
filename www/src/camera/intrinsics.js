// Cameras: what an image's pixels mean. The same model as the Rust side's `Camera`.

import { DeepSftError } from "../error.js";
import { isPinhole } from "./lens.js";

/**
 * A camera. Pixels are measured from the image's corner: the first pixel's centre is (0.5, 0.5).
 *
 * @typedef {object} Camera
 * @property {number} width image width, pixels
 * @property {number} height image height, pixels
 * @property {number} fx focal length along x, pixels
 * @property {number} fy focal length along y, pixels
 * @property {number} cx principal point, pixels
 * @property {number} cy principal point, pixels
 * @property {readonly number[]} [distortion] (k1, k2, p1, p2, k3), OpenCV's order; none when absent
 * @property {readonly number[]} [fisheye] the (k1, k2, k3, k4) of OpenCV's `cv::fisheye`, in place of `distortion`, for lenses that
 *   see more than about 100 degrees
 */

/**
 * Where intrinsics come from: the caller, a calibration made in this browser (by a sheet that moves, or one in a photograph), a
 * photograph's EXIF data, or the typical phone.
 *
 * @typedef {"given" | "calibrated" | "exif" | "estimated"} CameraSource
 */

/** @typedef {Camera & { source?: CameraSource, spread?: number }} KnownCamera */

/**
 * A camera, or a function that gives the camera for an image size; after a phone is turned it is asked again.
 * Without one the camera is estimated.
 *
 * @typedef {KnownCamera | ((width: number, height: number) => KnownCamera)} CameraOption
 */

/**
 * `spread` is the standard deviation of the focal length where it is known, pixels.
 *
 * @typedef {Camera & { distortion: readonly number[], source: CameraSource, spread?: number }} SourcedCamera
 */

/**
 * The cameras of the paper by name (its table of intrinsics), as the command line program knows them. One device differs from
 * the next by a few per cent.
 *
 * @type {Readonly<Record<"kinect-v2" | "realsense-d435" | "gopro-hero3", Readonly<Camera>>>}
 */
export const PAPER_CAMERAS = {
  "kinect-v2": { width: 1920, height: 1080, fx: 1057.8, fy: 1064, cx: 947.6, cy: 530.4 },
  "realsense-d435": { width: 1280, height: 720, fx: 915.5, fy: 915.5, cx: 645.5, cy: 366.3 },
  "gopro-hero3": { width: 1920, height: 1080, fx: 1686.8, fy: 1694.2, cx: 952.8, cy: 563.5 },
};

/**
 * Focal length of an unknown camera as a fraction of its image's long side: the median of a public table of 98
 * phones. Four of five lie within 0.73 and 1.01, so depth from it may be off by a sixth.
 */
export const TYPICAL_FOCAL_FRACTION = 0.79;

/**
 * The guess for an image of unknown origin: principal point at the centre, focal length
 * {@link TYPICAL_FOCAL_FRACTION} of the long side.
 *
 * @param {number} width pixels
 * @param {number} height pixels
 */
export function estimatedCamera(width, height) {
  return centredCamera(width, height, TYPICAL_FOCAL_FRACTION * Math.max(width, height), "estimated");
}

/**
 * A camera with square pixels and its principal point at the centre.
 *
 * @param {number} width pixels
 * @param {number} height pixels
 * @param {number} focal pixels
 * @param {CameraSource} source
 * @returns {SourcedCamera}
 */
export function centredCamera(width, height, focal, source) {
  return { width, height, fx: focal, fy: focal, cx: width / 2, cy: height / 2, distortion: [0, 0, 0, 0, 0], source };
}

/**
 * Checks a camera against the image it is for. A camera for the same picture at another scale is scaled, and one for it turned by a quarter
 * is turned clockwise, as a phone that is held upright turns its picture.
 *
 * @param {KnownCamera} camera
 * @param {number} width of the image, pixels
 * @param {number} height of the image, pixels
 * @returns {SourcedCamera}
 * @throws {DeepSftError} `camera-intrinsics` when a number is impossible or the image has another shape
 */
export function cameraForImage(camera, width, height) {
  const check = (/** @type {boolean | undefined} */ isSo, /** @type {string} */ message) => {
    if (!isSo) throw new DeepSftError("camera-intrinsics", `The camera's ${message}.`);
  };
  for (const name of /** @type {const} */ (["width", "height", "fx", "fy"]))
    check(Number.isFinite(camera[name]) && camera[name] > 0, `${name} is ${camera[name]}; it must be a positive number of pixels`);
  for (const name of /** @type {const} */ (["cx", "cy"])) check(Number.isFinite(camera[name]), `${name} is ${camera[name]}; it must be a number of pixels`);
  const distortion = [...(camera.distortion ?? [0, 0, 0, 0, 0])];
  if (distortion.length === 4) distortion.push(0);
  const isFive = distortion.length === 5 && distortion.every(Number.isFinite);
  check(isFive, "distortion must be k1, k2, p1, p2, k3; deepsft camera import makes five of OpenCV's longer lists");
  const { fisheye } = camera;
  check(!fisheye || (fisheye.length === 4 && fisheye.every(Number.isFinite)), "fisheye must be four numbers: k1, k2, k3, k4");
  check(!fisheye || isPinhole({ distortion }), "distortion and fisheye are both there; a lens has one of them");
  const [sx, sy] = [width / camera.width, height / camera.height];
  // Two pixels of rounding, as scalers leave, are the same picture; anything more is a crop or a rotation.
  const isSame = (/** @type {number} */ a, /** @type {number} */ b) => Math.abs(a - b) * Math.max(camera.width, camera.height) <= 2;
  if (!isSame(sx, sy)) {
    if (isSame(width / camera.height, height / camera.width)) return cameraForImage(turned({ ...camera, distortion }), width, height);
    check(false, `intrinsics are for images of ${camera.width} x ${camera.height}, this one has ${width} x ${height}`);
  }
  return {
    width,
    height,
    fx: camera.fx * sx,
    fy: camera.fy * sy,
    cx: camera.cx * sx,
    cy: camera.cy * sy,
    distortion,
    ...(fisheye && { fisheye }),
    source: camera.source ?? "given",
    ...(camera.spread && { spread: camera.spread * sx }),
  };
}

/** A camera for its image turned by a quarter clockwise. @param {KnownCamera & { distortion: number[] }} camera @returns {KnownCamera} */
function turned({ width, height, fx, fy, cx, cy, distortion: [k1, k2, p1, p2, k3], ...rest }) {
  return { ...rest, width: height, height: width, fx: fy, fy: fx, cx: height - cy, cy: cx, distortion: [k1, k2, p2, -p1, k3] };
}

/**
 * The camera of an image that may have been made smaller on its way.
 *
 * @param {CameraOption | undefined} option
 * @param {{ frame: { width: number, height: number }, width: number, height: number }} image the frame as it goes to the
 *   engine, and the size with which it came, pixels
 * @throws {DeepSftError} `camera-intrinsics`
 */
export function cameraForFrame(option, { frame, width, height }) {
  const camera = typeof option === "function" ? option(width, height) : (option ?? estimatedCamera(width, height));
  return cameraForImage(cameraForImage(camera, width, height), frame.width, frame.height);
}

/**
 * A camera's numbers in the order the engine takes them.
 *
 * @param {SourcedCamera} camera
 * @returns {number[]} fx, fy, cx, cy, k1, k2, p1, p2, k3; of a fisheye fx, fy, cx, cy, k1, k2, k3, k4
 */
export function intrinsicsOf({ fx, fy, cx, cy, distortion, fisheye }) {
  return [fx, fy, cx, cy, ...(fisheye ?? distortion)];
}
