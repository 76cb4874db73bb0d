import type { SourcedCamera } from "../camera/intrinsics.js";
/** @import { SourcedCamera } from "../camera/intrinsics.js" */
/**
 * The numbers of the canonical camera that stands for a camera, in the order the engine takes them.
 *
 * @param {{ width: number, height: number }} camera
 * @param {number} [focal] of the canonical image, pixels
 */
export declare function canonicalIntrinsics(camera: {
    width: number;
    height: number;
}, focal?: number): number[];
/**
 * The canonical image of a frame whose lens does not distort: a crop and a scale, black beyond the frame. It stands for the
 * frame wherever only the canonical image is looked at, with a quarter of the pixels of 960 x 540.
 *
 * Each pixel is the mean of about those that it covers, as in the engine's own warp (`deepsft-geometry`: `camera/canonical.rs`),
 * but not to the bit: browsers halve large pictures and interpolate what is left.
 *
 * @param {ImageBitmap} frame
 * @param {SourcedCamera} camera of the frame
 * @param {boolean} [asPixels] whether it is read at once, which costs least where the browser draws with the processor
 * @param {number} [focal] of the canonical image, pixels
 * @returns {ImageBitmap | ImageData | null} null where the engine's warp is needed, for the lens distorts, or the frame is hardly larger
 */
export declare function canonicalFrame(frame: ImageBitmap, camera: SourcedCamera, asPixels?: boolean, focal?: number): ImageBitmap | ImageData | null;
