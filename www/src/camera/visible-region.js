// The part of a camera's image that is looked at, by the engine's own rules (`deepsft-geometry`: `camera/canonical_views.rs`).

import { CANONICAL_FOCAL, canonicalFromImage, canonicalSize, imageFromCanonical } from "./canonical.js";

/** @import { Camera } from "./intrinsics.js" */

/** The widest view: 119 degrees across. */
const MIN_SCALE = 0.375;
/** A camera that sees less than this beyond the training camera's view has no other. */
const MIN_BEYOND = 1.05;
/** Places along each side of the image that say which rays it holds. */
const BORDER_PLACES = 16;

/**
 * The part of a camera's image that the network sees, pixels: the widest canonical image's rectangle, of a lens that distorts the one
 * through the middle of its sides, cut to the image. All but very wide images are seen whole.
 *
 * @param {Camera} camera
 */
export function visibleRegion(camera) {
  const { width, height } = canonicalSize(camera);
  // The widest canonical image has a focal length as short as the camera's image reaches beyond the training camera's.
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
  const focal = CANONICAL_FOCAL * (scale * MIN_BEYOND >= 1 ? 1 : Math.max(scale, MIN_SCALE));
  const [[left], [right]] = [0, width].map((x) => imageFromCanonical(camera, x, height / 2, focal));
  const [[, top], [, bottom]] = [0, height].map((y) => imageFromCanonical(camera, width / 2, y, focal));
  return {
    left: Math.max(0, left),
    top: Math.max(0, top),
    right: Math.min(camera.width, right),
    bottom: Math.min(camera.height, bottom),
  };
}
