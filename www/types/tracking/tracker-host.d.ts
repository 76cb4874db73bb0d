import { MeshTracker } from "../../pkg/deepsft_web.js";
import type { RawAnswer, TargetRequest } from "../engine/engine-worker.js";
import type { WorkerCalls } from "../engine/worker-calls.js";
export type TrackerWorker = WorkerCalls<typeof import("./tracker-host.js")>;
export type Smoothing = {
    minCutoff?: number;
    beta?: number;
};
export type TrackerStartRequest = {
    module: WebAssembly.Module;
    targets: TargetRequest[];
    smooth: Smoothing | null;
};
/** @param {TrackerStartRequest} request */
export declare function startTracker({ module, targets, smooth }: TrackerStartRequest): Promise<void>;
/** @param {TargetRequest} target */
export declare function trackTarget({ id, source }: TargetRequest): Promise<void>;
/** @param {{ id: number }} request */
export declare function untrackTarget({ id }: {
    id: number;
}): Promise<void>;
export type FollowRequest = {
    /**
     * ascending
     */
    timeS: number;
    /**
     * whether another camera or another file begins with it
     */
    afresh?: boolean;
    /**
     * or its canonical image
     */
    frame: ImageBitmap | ImageData;
    /**
     * of that
     */
    intrinsics: number[];
    /**
     * width, height and intrinsics of the camera that took it; those of `frame` when absent
     */
    source?: number[];
    /**
     * standard deviation of the camera's focal length as a fraction: infinite for a guess, 0 (the
     * default) where nobody wants it better
     */
    focalDeviation?: number;
    /**
     * of the canonical image that it is followed in, pixels; the training camera's when absent
     */
    focal?: number;
    /**
     * that the finders are asked about it
     */
    question?: NextFrame["question"];
};
export type NextFrame = Awaited<ReturnType<MeshTracker["follow"]>>["next"];
/**
 * A frame of the video.
 *
 * @typedef {object} FollowRequest
 * @property {number} timeS ascending
 * @property {boolean} [afresh] whether another camera or another file begins with it
 * @property {ImageBitmap | ImageData} frame or its canonical image
 * @property {number[]} intrinsics of that
 * @property {number[]} [source] width, height and intrinsics of the camera that took it; those of `frame` when absent
 * @property {number} [focalDeviation] standard deviation of the camera's focal length as a fraction: infinite for a guess, 0 (the
 *   default) where nobody wants it better
 * @property {number} [focal] of the canonical image that it is followed in, pixels; the training camera's when absent
 * @property {NextFrame["question"]} [question] that the finders are asked about it
 */
/**
 * What the next frame is for, if the camera stays the same: focal length of its canonical image, pixels; least time after the frame
 * before, milliseconds; what the finders should be asked about it, and whether the canonical image is enough for that.
 *
 * @typedef {Awaited<ReturnType<MeshTracker["follow"]>>["next"]} NextFrame
 */
/** @param {FollowRequest} request */
export declare function follow({ timeS, afresh, frame, intrinsics, source, focalDeviation, focal, question }: FollowRequest): Promise<{
    targets: {
        id: number;
        copy: number;
        found: boolean;
        held: boolean;
        surface: import("../../pkg/deepsft_web.js").RawSurface | null;
        correlation: number;
        iterations: number;
    }[];
    afresh: boolean;
    focal: {
        ratio: number;
        deviation: number;
    } | null;
    next: {
        focal: number;
        intervalMs: number;
        question: {
            ids: number[];
            onlyConfirms: boolean;
        } | null;
    };
    times: {
        warpMs: number;
        trackMs: number;
    };
    readMs: number;
}>;
export type FinderAnswers = {
    answers: RawAnswer[];
    tookMs: number;
    sinceMissedMs: number;
};
/** What the finders say, how long that took, and how long ago a frame was missed. @typedef {{ answers: RawAnswer[], tookMs: number, sinceMissedMs: number }} FinderAnswers */
/** @param {FinderAnswers} request */
export declare function answer({ answers, tookMs, sinceMissedMs }: FinderAnswers): Promise<{
    effects: {
        id: number;
        effect: "started" | "confirmed" | "restarted" | "dropped" | "ignored";
    }[];
    next: {
        focal: number;
        intervalMs: number;
        question: {
            ids: number[];
            onlyConfirms: boolean;
        } | null;
    } | null;
    answerMs: number;
}>;
/** @param {{ id: number }} request */
export declare function trackedMaps({ id }: {
    id: number;
}): Promise<{
    width: number;
    focal: number;
    depth: Float32Array;
    registration: Float32Array;
}>;
