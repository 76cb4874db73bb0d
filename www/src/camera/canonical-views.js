// How far the canonical view is zoomed out: the engine's own rules (`deepsft-geometry`: `camera/canonical_views.rs`), for frames of which
// the browser makes the canonical image.

import { CANONICAL_FOCAL, canonicalFromImage, canonicalSize, imageFromCanonical, verticesInImage } from "./canonical.js";

/** @import { Camera } from "./intrinsics.js" */

/** Focal lengths between the training camera's and the widest, as multiples of the training camera's. */
const STEPS = [0.75, 0.5];
/** The widest: 119 degrees across. */
const MIN_SCALE = 0.375;
/** A view that reaches less beyond the one before, as a multiple, is left out. */
const MIN_GAIN = 1.1;
/** A camera that sees less than this beyond the training camera's view has no other. */
const MIN_BEYOND = 1.05;
/** Places along each side of the image that say which rays it holds. */
const BORDER_PLACES = 16;
/** Pixels between a mesh and a view's border for which the mesh counts as held: by a view that is chosen anew, left, and returned to. */
const MARGIN = { new: 8, leave: 3, return: 24 };

/**
 * Focal lengths of the canonical images that may stand for a camera's: the training camera's, then shorter ones, as far as the image
 * reaches beyond.
 *
 * @param {Camera} camera
 * @returns {number[]} pixels, the widest view last
 */
export function canonicalFocals(camera) {
  const whole = wholeImageScale(camera);
  if (whole * MIN_BEYOND >= 1) return [CANONICAL_FOCAL];
  const scales = [1, ...STEPS.filter((step) => step > MIN_GAIN * whole), whole];
  return scales.map((scale) => scale * CANONICAL_FOCAL);
}

/**
 * The focal length with which the canonical image would hold all of the camera's, as a multiple of the training camera's.
 *
 * @param {Camera} camera
 */
function wholeImageScale(camera) {
  const { width, height } = canonicalSize(camera);
  let scale = 1;
  for (let k = 0; k <= BORDER_PLACES; k++) {
    const [x, y] = [(camera.width * k) / BORDER_PLACES, (camera.height * k) / BORDER_PLACES];
    for (const place of [[x, 0], [x, camera.height], [0, y], [camera.width, y]]) {
      const [column, row] = canonicalFromImage(camera, place[0], place[1]);
      const beyond = Math.max(Math.abs(column - width / 2) / (width / 2), Math.abs(row - height / 2) / (height / 2));
      // Where no ray comes from the lens reaches beyond anything.
      scale = Math.min(scale, Number.isFinite(beyond) ? 1 / beyond : 0);
    }
  }
  return Math.max(scale, MIN_SCALE);
}

/**
 * The part of a camera's image that the network sees, pixels: the widest canonical image's rectangle, of a lens that distorts the one
 * through the middle of its sides, cut to the image. All but very wide images are seen whole.
 *
 * @param {Camera} camera
 * @returns {{ left: number, top: number, right: number, bottom: number }}
 */
export function visibleRegion(camera) {
  const { width, height } = canonicalSize(camera);
  const focal = Math.min(...canonicalFocals(camera));
  const [[left], [right]] = [0, width].map((x) => imageFromCanonical(camera, x, height / 2, focal));
  const [[, top], [, bottom]] = [0, height].map((y) => imageFromCanonical(camera, width / 2, y, focal));
  return {
    left: Math.max(0, left),
    top: Math.max(0, top),
    right: Math.min(camera.width, right),
    bottom: Math.min(camera.height, bottom),
  };
}

/** Chooses the view of each frame of a video: by the meshes while some are followed, else the nearest and the widest in turn. */
export class ViewChoice {
  /** @type {{ camera: Camera, focals: number[] } | null} */
  #known = null;
  #focal = CANONICAL_FOCAL;
  /** Whether the finders have looked for missing targets in the view that is chosen. */
  #searched = false;

  /**
   * @param {Camera} camera of the next frame
   * @param {Float32Array[]} meshes vertices of those that are followed, camera frame
   * @param {boolean} searches whether the finders look at this frame
   * @returns {number} focal length of its canonical image, pixels
   */
  next(camera, meshes, searches) {
    const focals = this.#focalsOf(camera);
    if (focals.length === 1) return focals[0];
    if (meshes.length > 0) {
      this.#searched = false;
      this.#focal = Math.min(...meshes.map((vertices) => following(camera, focals, this.#focal, vertices)));
    } else if (searches) {
      if (this.#searched) this.#focal = this.#focal === focals[0] ? focals[focals.length - 1] : focals[0];
      this.#searched = true;
    }
    return this.#focal;
  }

  /** A finder has seen something in the view of its frame, which therefore stays: a track is about to start there. */
  seen() {
    this.#searched = false;
  }

  /** @param {Camera} camera */
  #focalsOf(camera) {
    if (this.#known && isSameCamera(this.#known.camera, camera)) return this.#known.focals;
    this.#known = { camera, focals: canonicalFocals(camera) };
    [this.#focal, this.#searched] = [this.#known.focals[0], false];
    return this.#known.focals;
  }
}

/** @param {Camera} a @param {Camera} b */
function isSameCamera(a, b) {
  const numbers = (/** @type {Camera} */ { width, height, fx, fy, cx, cy, distortion = [], fisheye = [] }) =>
    [width, height, fx, fy, cx, cy, ...distortion, ...fisheye].join();
  return a === b || numbers(a) === numbers(b);
}

/**
 * The view for the next frame after one with a mesh: the current one, until the mesh leaves it or a nearer one holds it by far.
 *
 * @param {Camera} camera
 * @param {number[]} focals
 * @param {number} current
 * @param {Float32Array} vertices
 * @returns {number}
 */
function following(camera, focals, current, vertices) {
  const holding = (/** @type {number[]} */ views, /** @type {number} */ margin) =>
    views.find((focal) => holds(camera, focal, vertices, margin)) ?? focals[focals.length - 1];
  const nearer = holding(focals, MARGIN.return);
  if (nearer > current) return nearer;
  if (holds(camera, current, vertices, MARGIN.leave)) return current;
  return holding(focals.filter((focal) => focal <= current), MARGIN.new);
}

/**
 * Whether a view holds as much of a mesh as the image does.
 *
 * @param {Camera} camera
 * @param {number} focal of the view
 * @param {Float32Array} vertices
 * @param {number} margin pixels from its border
 */
function holds(camera, focal, vertices, margin) {
  const { width, height } = canonicalSize(camera);
  const inImage = verticesInImage(vertices, camera);
  for (let i = 0; 3 * i < vertices.length; i++) {
    const [x, y, z] = vertices.subarray(3 * i, 3 * i + 3);
    const [column, row] = [inImage[2 * i], inImage[2 * i + 1]];
    if (z <= 0 || !(column >= 0 && row >= 0 && column <= camera.width && row <= camera.height)) continue;
    const across = Math.abs((x / z) * focal) + margin;
    const down = Math.abs((y / z) * focal) + margin;
    if (across > width / 2 || down > height / 2) return false;
  }
  return true;
}
