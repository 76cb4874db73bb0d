import { PerspectiveCamera } from "three";
import type { Camera } from "../camera/intrinsics.js";
export type FrameFit = "cover" | "contain" | number;
export type Region = {
    left: number;
    top: number;
    right: number;
    bottom: number;
};
/** @import { Camera } from "../camera/intrinsics.js" */
/**
 * How an image fills a canvas of another shape, as CSS says it: `cover` cuts what juts out, `contain` shows all of it. A number covers the
 * canvas as far as the image is then at most so many times as large as `contain` has it. The image lies centred.
 *
 * @typedef {"cover" | "contain" | number} FrameFit
 */
/** A part of an image, pixels. @typedef {{ left: number, top: number, right: number, bottom: number }} Region */
/**
 * Sees what a video's camera sees, in millimetres: at the origin, looking along -z with y up, like any camera of three.js.
 *
 * A canvas pixel and the image point below it are one ray, also where image and canvas differ in shape. The lens' distortion is no part
 * of it: {@link FrameBackground} takes it out of the image.
 */
export declare class FrameCamera extends PerspectiveCamera {
    /** @type {FrameFit} */
    fit: FrameFit;
    /** @type {Camera | null} of the newest frame */
    intrinsics: Camera | null;
    /** What of the image the canvas shows; it reaches beyond the image where `contain` leaves borders. @type {Region} */
    region: Region;
    /** @param {{ near?: number, far?: number, fit?: FrameFit }} [options] near and far in mm, default 20 and 10,000; fit default `cover` */
    constructor({ near, far, fit }?: {
        near?: number;
        far?: number;
        fit?: FrameFit;
    });
    /**
     * Takes over a frame's camera and the canvas's shape; cheap enough for each frame.
     *
     * @param {Camera} intrinsics `tracked.camera`
     * @param {{ width: number, height: number }} canvas its size in any unit: the element, or a Vector2 from `renderer.getSize`
     */
    setIntrinsics(intrinsics: Camera, canvas: {
        width: number;
        height: number;
    }): void;
    /**
     * Sees a part of the image alone, which the canvas then shows, until the next {@link setIntrinsics}.
     *
     * @param {Region} region
     */
    lookAtRegion(region: Region): void;
}
