/** Columns of the canonical image and of maps, of an upright camera rows. */
export declare const CANONICAL_WIDTH = 480;
/** Rows of the canonical image and of maps, of an upright camera columns. */
export declare const CANONICAL_HEIGHT = 270;
/** Focal length of the training camera, pixels; its principal point is the image's centre. Where an object is too near for its angle of view
 * the canonical image has a shorter one: `focal` of an estimate. */
export declare const CANONICAL_FOCAL = 380;
import type { Camera } from "./intrinsics.js";
/** @import { Camera } from "./intrinsics.js" */
/**
 * Columns and rows of the canonical image, and of the maps: the canonical camera is held upright where the camera's image is upright.
 *
 * @param {{ width: number, height: number }} camera
 */
export declare function canonicalSize({ width, height }: {
    width: number;
    height: number;
}): {
    width: number;
    height: number;
};
/**
 * Position in a camera's image, pixels, of a position in the canonical image, pixels.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @param {number} [focal] of the canonical image, pixels: an estimate's own where the object was too near for the training camera's
 * @returns {[number, number]}
 */
export declare function imageFromCanonical(camera: Camera, x: number, y: number, focal?: number): [number, number];
/**
 * Where the vertices of a mesh lie in a camera's image.
 *
 * @param {Float32Array} vertices (x, y, z) each, camera frame
 * @param {Camera} camera
 * @param {number} [scale] of the result
 * @returns {Float32Array} (x, y) each, pixels times the scale
 */
export declare function verticesInImage(vertices: Float32Array, camera: Camera, scale?: number): Float32Array;
/**
 * Position in the canonical image, pixels, of a position in a camera's image, pixels: the inverse of
 * {@link imageFromCanonical}.
 *
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 * @param {number} [focal] as there
 * @returns {[number, number]}
 */
export declare function canonicalFromImage(camera: Camera, x: number, y: number, focal?: number): [number, number];
