import { TrackedFrame } from "../results/tracked-frame.js";
import type { RawAnswer } from "../engine/engine-worker.js";
import type { Estimate } from "../results/estimate.js";
import type { CameraOption, SourcedCamera } from "../camera/intrinsics.js";
import type { Target } from "../targets/target.js";
import type { LastingTracker, ToldFrame } from "./lasting-tracker.js";
import type { TrackerStartRequest } from "./tracker-worker.js";
export type FoundFocal = {
    width: number;
    height: number;
    focal: number;
    spread: number;
};
export type MeshTrackingParts = {
    targets: Target[];
    /**
     * ended with the loop
     */
    tracker: LastingTracker;
    start: TrackerStartRequest;
    find: (question: Question) => Promise<{
        answers: RawAnswer[];
        estimate: Estimate | null;
    }>;
    camera: CameraOption | undefined;
    /**
     * whether the browser draws with the processor
     */
    software: boolean;
    onTracked: (tracked: TrackedFrame) => void;
    onFound?: (target: Target, tracked: TrackedFrame) => void;
    onLost?: (target: Target, tracked: TrackedFrame) => void;
    onEstimate?: (estimate: Estimate, frame: number) => void;
    onFocal?: (focal: FoundFocal) => void;
};
export type Question = {
    /**
     * of the targets to look for
     */
    ids: number[];
    /**
     * closed with the estimate, or when there is none
     */
    frame: ImageBitmap;
    /**
     * the canonical image where it is enough; closed with the answer
     */
    canonical: ImageBitmap | null;
    /**
     * of the frame
     */
    camera: SourcedCamera;
    /**
     * of the canonical image that is looked at, pixels
     */
    focal: number;
};
/** @import { RawAnswer } from "../engine/engine-worker.js" */
/** @import { Estimate } from "../results/estimate.js" */
/** @import { CameraOption, SourcedCamera } from "../camera/intrinsics.js" */
/** @import { Target } from "../targets/target.js" */
/** @import { LastingTracker, ToldFrame } from "./lasting-tracker.js" */
/** @import { FinderQuestion, NextFrame, TrackerStartRequest } from "./tracker-worker.js" */
/**
 * A focal length that was found from a sheet that bends: of images of `width` x `height` pixels, with its standard deviation
 * (`spread`), all in pixels.
 *
 * @typedef {{ width: number, height: number, focal: number, spread: number }} FoundFocal
 */
/**
 * @typedef {object} MeshTrackingParts
 * @property {Target[]} targets
 * @property {LastingTracker} tracker ended with the loop
 * @property {TrackerStartRequest} start
 * @property {(question: Question) => Promise<{ answers: RawAnswer[], estimate: Estimate | null }>} find
 * @property {CameraOption | undefined} camera
 * @property {boolean} software whether the browser draws with the processor
 * @property {(tracked: TrackedFrame) => void} onTracked
 * @property {(target: Target, tracked: TrackedFrame) => void} [onFound]
 * @property {(target: Target, tracked: TrackedFrame) => void} [onLost]
 * @property {(estimate: Estimate, frame: number) => void} [onEstimate]
 * @property {(focal: FoundFocal) => void} [onFocal]
 */
/**
 * What the finders are asked.
 *
 * @typedef {object} Question
 * @property {number[]} ids of the targets to look for
 * @property {ImageBitmap} frame closed with the estimate, or when there is none
 * @property {ImageBitmap | null} canonical the canonical image where it is enough; closed with the answer
 * @property {SourcedCamera} camera of the frame
 * @property {number} focal of the canonical image that is looked at, pixels
 */
/** Meshes being followed through a video. */
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
     * Depth and registration of a target's mesh in the newest frame, as in an `Estimate`: rows of `width` columns, -1 where the mesh is
     * not seen, and the focal length of the canonical image that they belong to. Rejects once stopped.
     *
     * @param {Target} [target] the first when absent
     * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
     * @throws {DeepSftError} `target-unknown`, `closed`
     */
    maps(target?: Target): Promise<{
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    }>;
    /**
     * Follows a target no longer. `onLost` is not called for it.
     *
     * @param {Target} target one that is not followed is left alone
     */
    unfollow({ id }: Target): void;
}
export type Following = {
    number: number;
    frame: ImageBitmap;
    camera: SourcedCamera;
    /**
     * with which the frame came, pixels
     */
    size: {
        width: number;
        height: number;
    };
    /**
     * when the tracker was free for it, milliseconds
     */
    began: number;
    grabMs: number;
    answer: Promise<ToldFrame>;
};
/**
 * A frame that the tracker is following.
 *
 * @typedef {object} Following
 * @property {number} number
 * @property {ImageBitmap} frame
 * @property {SourcedCamera} camera
 * @property {{ width: number, height: number }} size with which the frame came, pixels
 * @property {number} began when the tracker was free for it, milliseconds
 * @property {number} grabMs
 * @property {Promise<ToldFrame>} answer
 */
