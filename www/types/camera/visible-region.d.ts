import type { Camera } from "./intrinsics.js";
/**
 * The part of a camera's image that the network sees, pixels: the widest canonical image's rectangle, of a lens that distorts the one
 * through the middle of its sides, cut to the image. All but very wide images are seen whole.
 *
 * @param {Camera} camera
 */
export declare function visibleRegion(camera: Camera): {
    left: number;
    top: number;
    right: number;
    bottom: number;
};
