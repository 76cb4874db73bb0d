import type { SourcedCamera } from "../camera/intrinsics.js";
import type { SurfaceMesh } from "./surface-mesh.js";
export type TrackedTimes = {
    captureMs: number;
    warpMs: number;
    trackMs: number;
    totalMs: number;
};
/** @import { SourcedCamera } from "../camera/intrinsics.js" */
/** @import { SurfaceMesh } from "./surface-mesh.js" */
/**
 * Milliseconds spent on a frame: `capture` (grabbing it and reading its pixels), `warp` (to the canonical image),
 * `track`, and `total`, from when the tracker was free for it to the result.
 *
 * @typedef {{ captureMs: number, warpMs: number, trackMs: number, totalMs: number }} TrackedTimes
 */
/** One frame of a video with the mesh in it. */
export declare class TrackedFrame {
    /** Counts the frames the tracker saw, from 1. */
    number: number;
    /** Whether the template is being followed. */
    found: boolean;
    /** The whole surface, hidden parts included; null unless found. */
    mesh: SurfaceMesh | null;
    /** Fraction of the visible print that the image confirms, 0 to 1. */
    agreement: number;
    /** Solver iterations this frame took. */
    iterations: number;
    /** The camera that was used, with its source. */
    camera: SourcedCamera;
    times: TrackedTimes;
    /** Answers of the network per second, by the time between the last two; 0 before. */
    networkFps: number;
    /** The frame the mesh belongs to: draw over this one, not over what the video shows by now. Closed by `close()`. */
    frame: ImageBitmap | null;
    /**
     * @param {object} contents
     * @param {number} contents.number
     * @param {SurfaceMesh | null} contents.mesh
     * @param {number} contents.agreement
     * @param {number} contents.iterations
     * @param {SourcedCamera} contents.camera
     * @param {TrackedTimes} contents.times
     * @param {number} contents.networkFps
     * @param {ImageBitmap | null} contents.frame
     */
    constructor({ number, mesh, agreement, iterations, camera, times, networkFps, frame }: {
        number: number;
        mesh: SurfaceMesh | null;
        agreement: number;
        iterations: number;
        camera: SourcedCamera;
        times: TrackedTimes;
        networkFps: number;
        frame: ImageBitmap | null;
    });
    /** Lets the frame go. */
    close(): void;
}
