import type { Camera } from "./intrinsics.js";
/**
 * Focal lengths of the canonical images that may stand for a camera's: the training camera's, then shorter ones, as far as the image
 * reaches beyond.
 *
 * @param {Camera} camera
 * @returns {number[]} pixels, the widest view last
 */
export declare function canonicalFocals(camera: Camera): number[];
/**
 * The part of a camera's image that the network sees, pixels: the widest canonical image's rectangle, of a lens that distorts the one
 * through the middle of its sides, cut to the image. All but very wide images are seen whole.
 *
 * @param {Camera} camera
 * @returns {{ left: number, top: number, right: number, bottom: number }}
 */
export declare function visibleRegion(camera: Camera): {
    left: number;
    top: number;
    right: number;
    bottom: number;
};
/** Chooses the view of each frame of a video: by the meshes while some are followed, else the nearest and the widest in turn. */
export declare class ViewChoice {
    #private;
    /**
     * @param {Camera} camera of the next frame
     * @param {Float32Array[]} meshes vertices of those that are followed, camera frame
     * @param {boolean} searches whether the finders look at this frame
     * @returns {number} focal length of its canonical image, pixels
     */
    next(camera: Camera, meshes: Float32Array[], searches: boolean): number;
    /** A finder has seen something in the view of its frame, which therefore stays: a track is about to start there. */
    seen(): void;
}
