// The focal length of an unknown camera, from the registration of the sheet held flat in several tilts: each view of
// a plane gives two equations in the focal length (Zhang, "A flexible new technique for camera calibration", 2000,
// section 3.1), here with square pixels and the principal point at the centre.

import { fitHomography } from "./homography.js";

/** @import { Estimate } from "../results/estimate.js" */

/** Views that make a calibration: with registration good to a pixel, eight tilts give the focal length to about 2 %. */
const VIEWS = 8;
/** Every how many canonical pixels a point is taken. */
const STEP = 6;
const MIN_POINTS = 150;
/** A sheet is flat when a homography explains its registration to this many canonical pixels (RMS). */
const FLAT_RMS = 2;
/** Below this tilt a view says nothing about the focal length. */
const MIN_TILT = (20 * Math.PI) / 180;
/** Views whose normals are closer than this say the same. */
const MIN_TURN = (7 * Math.PI) / 180;

/**
 * What became of a frame: `taken`, or why not.
 *
 * @typedef {"taken" | "not-found" | "not-flat" | "not-tilted" | "too-similar"} ViewVerdict
 */

/** @typedef {{ a: number[], b: number[], normal: number[] }} View equations a / f^2 + b = 0, and the sheet's normal */

/** Gathers views of the flat sheet until the focal length is known. */
export class FocalCalibration {
  /** @type {View[]} */
  #views = [];
  #plane;

  /** @param {{ widthMm: number, heightMm: number }} template size of the sheet */
  constructor({ widthMm, heightMm }) {
    this.#plane = { widthMm, heightMm };
  }

  /** Views wanted. */
  get wanted() {
    return VIEWS;
  }

  /** Views taken. */
  get taken() {
    return this.#views.length;
  }

  /**
   * Looks at one frame, all of the same camera and size.
   *
   * @param {Estimate} estimate
   * @returns {ViewVerdict}
   */
  add(estimate) {
    if (!estimate.found) return "not-found";
    const { plane, image } = this.#correspondences(estimate);
    if (plane.length < MIN_POINTS) return "not-found";
    const fit = fitHomography(plane, image);
    if (fit === null || fit.rms > FLAT_RMS) return "not-flat";
    // Canonical pixels to image pixels about the principal point.
    const scale = estimate.camera.fx / estimate.focal;
    const view = viewFromHomography(fit.matrix, scale, estimate.camera.fx);
    if (Math.acos(Math.min(1, Math.abs(view.normal[2]))) < MIN_TILT) return "not-tilted";
    const turned = (/** @type {View} */ { normal }) =>
      Math.acos(Math.min(1, Math.abs(normal.reduce((sum, n, i) => sum + n * view.normal[i], 0))));
    if (this.#views.some((other) => turned(other) < MIN_TURN)) return "too-similar";
    this.#views.push(view);
    return "taken";
  }

  /**
   * The focal length in pixels of the images that were looked at, and its spread: the standard error by leaving one
   * view out at a time. Null until all views are taken, or when they contradict each other.
   *
   * @returns {{ focal: number, spread: number } | null}
   */
  result() {
    if (this.#views.length < VIEWS) return null;
    const focal = focalFromViews(this.#views);
    const without = this.#views.map((left) => focalFromViews(this.#views.filter((view) => view !== left)));
    const variance = without.reduce((sum, f) => sum + (f - focal) ** 2, 0) * (1 - 1 / without.length);
    const spread = Math.sqrt(variance);
    return Number.isFinite(focal) && Number.isFinite(spread) ? { focal, spread } : null;
  }

  /**
   * Points of the sheet, mm about its centre, and where the canonical image shows them, pixels about its centre.
   *
   * @param {Estimate} estimate
   */
  #correspondences(estimate) {
    const { width, height } = estimate.mask;
    const [registration, mask] = [estimate.registration.values(), estimate.mask.values()];
    const { widthMm, heightMm } = this.#plane;
    /** @type {[number, number][]} */
    const plane = [];
    /** @type {[number, number][]} */
    const image = [];
    for (let y = STEP >> 1; y < height; y += STEP) {
      for (let x = STEP >> 1; x < width; x += STEP) {
        const i = y * width + x;
        if (mask[i] === 0) continue;
        plane.push([(registration[2 * i] - 0.5) * widthMm, (registration[2 * i + 1] - 0.5) * heightMm]);
        image.push([x + 0.5 - width / 2, y + 0.5 - height / 2]);
      }
    }
    return { plane, image };
  }
}

/**
 * @param {readonly number[]} h homography from mm to canonical pixels about the principal point
 * @param {number} scale image pixels per canonical pixel
 * @param {number} focal assumed, image pixels, to weigh the equations and to know the tilt
 * @returns {View}
 */
function viewFromHomography(h, scale, focal) {
  // Columns h1, h2 of the homography in units of the assumed focal length.
  const unit = scale / focal;
  const h1 = [h[0] * unit, h[3] * unit, h[6]];
  const h2 = [h[1] * unit, h[4] * unit, h[7]];
  const norm = (Math.hypot(...h1) + Math.hypot(...h2)) / 2;
  const [p, q] = [h1.map((x) => x / norm), h2.map((x) => x / norm)];
  // h1 . W h2 = 0 and h1 . W h1 = h2 . W h2 with W = diag(1/f^2, 1/f^2, 1), in pixels again.
  const square = focal * focal;
  const a = [(p[0] * q[0] + p[1] * q[1]) * square, (p[0] ** 2 + p[1] ** 2 - q[0] ** 2 - q[1] ** 2) * square];
  const b = [p[2] * q[2], p[2] ** 2 - q[2] ** 2];
  const n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const length = Math.hypot(...n);
  return { a, b, normal: n.map((x) => x / length) };
}

/**
 * Least squares for 1 / f^2.
 *
 * @param {View[]} views
 */
function focalFromViews(views) {
  let [aa, ab] = [0, 0];
  for (const { a, b } of views) {
    for (let i = 0; i < 2; i++) {
      aa += a[i] * a[i];
      ab += a[i] * b[i];
    }
  }
  return Math.sqrt(-aa / ab);
}
