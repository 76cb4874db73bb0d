import { TrackedFrame } from "../results/tracked-frame.js";
import type { Estimate } from "../results/estimate.js";
import type { CameraOption, SourcedCamera } from "../camera/intrinsics.js";
import type { RawTracked, TrackerStartRequest, TrackerWorker } from "./tracker-worker.js";
export type MeshTrackingParts = {
    /**
     * ended with the loop
     */
    tracker: TrackerWorker;
    start: TrackerStartRequest;
    estimate: (frame: ImageBitmap, camera: CameraOption) => Promise<Estimate>;
    camera: CameraOption | undefined;
    onTracked: (tracked: TrackedFrame) => void;
    onEstimate: ((estimate: Estimate, frame: number) => void) | undefined;
};
/**
 * @typedef {object} MeshTrackingParts
 * @property {TrackerWorker} tracker ended with the loop
 * @property {TrackerStartRequest} start
 * @property {(frame: ImageBitmap, camera: CameraOption) => Promise<Estimate>} estimate
 * @property {CameraOption | undefined} camera
 * @property {(tracked: TrackedFrame) => void} onTracked
 * @property {((estimate: Estimate, frame: number) => void) | undefined} onEstimate
 */
/** A mesh being followed through a video. */
export declare class MeshTracking {
    #private;
    /**
     * Resolves when the loop was stopped; rejects with what ended it otherwise, an error of the engine or one that
     * a callback threw.
     *
     * @type {Promise<void>}
     */
    finished: Promise<void>;
    /**
     * @param {HTMLVideoElement} video
     * @param {MeshTrackingParts} parts
     */
    constructor(video: HTMLVideoElement, parts: MeshTrackingParts);
    /** Ends the loop; no callback is called again. */
    stop(): void;
    /**
     * Depth and registration of the mesh in the newest frame, as in an `Estimate`: 270 rows of 480 columns, -1 where the
     * mesh is not seen. Rejects once stopped.
     *
     * @returns {Promise<{ depth: Float32Array, registration: Float32Array }>}
     */
    maps(): Promise<{
        depth: Float32Array;
        registration: Float32Array;
    }>;
}
export type Following = {
    number: number;
    camera: SourcedCamera;
    /**
     * when the tracker was free for it, milliseconds
     */
    began: number;
    grabMs: number;
    answer: Promise<RawTracked>;
};
/**
 * A frame that the tracker is following.
 *
 * @typedef {object} Following
 * @property {number} number
 * @property {SourcedCamera} camera
 * @property {number} began when the tracker was free for it, milliseconds
 * @property {number} grabMs
 * @property {Promise<RawTracked>} answer
 */
