import { Box3 } from "three";
import type { Object3D } from "three";
import type { FrameCamera, Region } from "../three/frame-camera.js";
export type Box = {
    left: number;
    top: number;
    width: number;
    height: number;
};
/** @import { BufferGeometry, Object3D } from "three" */
/** @import { FrameCamera, Region } from "../three/frame-camera.js" */
/** On the page, CSS pixels. @typedef {{ left: number, top: number, width: number, height: number }} Box */
/**
 * The part of an image that a box on the page shows.
 *
 * @param {Box} box
 * @param {Region} region that the whole page shows
 * @param {{ width: number }} page
 * @returns {Region}
 */
export declare function regionOf(box: Box, region: Region, page: {
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
