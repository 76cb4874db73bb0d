import { Box3 } from "three";
import type { Object3D } from "three";
import type { FrameCamera, Region } from "../three/frame-camera.js";
/** The camera's picture, and the box over it that WebGL draws in. */
export declare class FrameLayer {
    #private;
    constructor();
    /** What it is shown on. */
    get canvas(): HTMLCanvasElement;
    /** Takes over a frame. @param {ImageBitmap} frame */
    take(frame: ImageBitmap): void;
    /**
     * Lays it where the camera sees it.
     *
     * @param {FrameCamera} camera
     * @param {{ width: number }} page what the whole image is laid out on, CSS pixels
     */
    place({ intrinsics, region }: FrameCamera, page: {
        width: number;
    }): void;
    /**
     * The box on the page in which something of a scene is drawn.
     *
     * @param {Object3D} scene whose matrices are those of now
     * @param {FrameCamera} camera that sees the whole page
     * @param {{ width: number, height: number }} page CSS pixels
     * @returns {{ left: number, top: number, width: number, height: number } | null} null where nothing is
     */
    boxOf(scene: Object3D, camera: FrameCamera, page: {
        width: number;
        height: number;
    }): {
        left: number;
        top: number;
        width: number;
        height: number;
    } | null;
}
/**
 * Lays an element out over what it lies in. It is moved by a transform, for which the browser lays nothing else out.
 *
 * @param {HTMLElement} element
 * @param {{ left: number, top: number, width: number, height: number }} place CSS pixels
 */
export declare function layOut({ style }: HTMLElement, { left, top, width, height }: {
    left: number;
    top: number;
    width: number;
    height: number;
}): void;
/**
 * The part of an image that a box on the page shows.
 *
 * @param {{ left: number, top: number, width: number, height: number }} box
 * @param {Region} region that the whole page shows
 * @param {{ width: number }} page
 * @returns {Region}
 */
export declare function regionOf(box: {
    left: number;
    top: number;
    width: number;
    height: number;
}, region: Region, page: {
    width: number;
}): Region;
/**
 * Where anything of a scene is drawn.
 *
 * @param {Object3D} scene whose matrices are those of now
 * @param {FrameCamera} camera
 * @returns {Box3} in clip space; it reaches everywhere where something lies beside the eye
 */
export declare function extentOf(scene: Object3D, camera: FrameCamera): Box3;
