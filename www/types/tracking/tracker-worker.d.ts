import { WorkerCalls } from "../engine/worker-calls.js";
import type { RawSurface } from "../../pkg/deepsft_web.js";
import type { RawAnswer, TargetRequest } from "../engine/engine-worker.js";
export type Smoothing = {
    minCutoff?: number;
    beta?: number;
};
export type TrackerStartRequest = {
    module: WebAssembly.Module;
    targets: TargetRequest[];
    smooth: Smoothing | null;
};
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
    question?: FinderQuestion | null;
};
export type FinderQuestion = {
    ids: number[];
    onlyConfirms: boolean;
};
export type NextFrame = {
    focal: number;
    intervalMs: number;
    question: FinderQuestion | null;
};
export type AnswerRequest = {
    answers: RawAnswer[];
    tookMs: number;
    sinceMissedMs: number;
};
export type AnswerEffect = {
    id: number;
    effect: "started" | "confirmed" | "restarted" | "dropped" | "ignored";
};
export type RawTrackedTarget = {
    id: number;
    copy: number;
    found: boolean;
    held: boolean;
    surface: RawSurface | null;
    correlation: number;
    iterations: number;
};
export type RawTracked = {
    targets: RawTrackedTarget[];
    /**
     * whether all that was seen before was forgotten
     */
    afresh: boolean;
    /**
     * the true focal length as a multiple of the given one, where it is told,
     * and its standard deviation as a fraction
     */
    focal: {
        ratio: number;
        deviation: number;
    } | null;
    next: NextFrame;
    times: {
        warpMs: number;
        trackMs: number;
    };
    /**
     * time to read the frame's pixels
     */
    readMs: number;
};
/** @import { RawSurface } from "../../pkg/deepsft_web.js" */
/** @import { RawAnswer, TargetRequest } from "../engine/engine-worker.js" */
/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */
/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */
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
 * @property {FinderQuestion | null} [question] that the finders are asked about it
 */
/** Which targets the finders look for, and whether the canonical image is enough. @typedef {{ ids: number[], onlyConfirms: boolean }} FinderQuestion */
/**
 * What the next frame is for, if the camera stays the same: focal length of its canonical image, pixels; least time after the frame
 * before, milliseconds; what the finders should be asked about it.
 *
 * @typedef {{ focal: number, intervalMs: number, question: FinderQuestion | null }} NextFrame
 */
/** What the finders say, how long that took, and how long ago a frame was missed. @typedef {{ answers: RawAnswer[], tookMs: number, sinceMissedMs: number }} AnswerRequest */
/**
 * What the tracker made of an answer for a target.
 *
 * @typedef {{ id: number, effect: "started" | "confirmed" | "restarted" | "dropped" | "ignored" }} AnswerEffect
 */
/**
 * One copy of a target in a frame, the first with the number 0: `surface` is null unless found.
 *
 * @typedef {{ id: number, copy: number, found: boolean, held: boolean, surface: RawSurface | null, correlation: number, iterations: number }} RawTrackedTarget
 */
/**
 * The meshes in one frame as they cross from the worker.
 *
 * @typedef {object} RawTracked
 * @property {RawTrackedTarget[]} targets
 * @property {boolean} afresh whether all that was seen before was forgotten
 * @property {{ ratio: number, deviation: number } | null} focal the true focal length as a multiple of the given one, where it is told,
 *   and its standard deviation as a fraction
 * @property {NextFrame} next
 * @property {{ warpMs: number, trackMs: number }} times
 * @property {number} readMs time to read the frame's pixels
 */
/** The worker that follows meshes. */
export declare class TrackerWorker extends WorkerCalls {
    /**
     * @param {TrackerStartRequest} request
     * @returns {Promise<void>}
     */
    start(request: TrackerStartRequest): Promise<void>;
    /**
     * @param {TargetRequest} target
     * @returns {Promise<void>}
     */
    track(target: TargetRequest): Promise<void>;
    /**
     * @param {{ id: number }} request
     * @returns {Promise<void>}
     */
    untrack(request: {
        id: number;
    }): Promise<void>;
    /**
     * @param {FollowRequest} request
     * @returns {Promise<RawTracked>}
     */
    follow(request: FollowRequest): Promise<RawTracked>;
    /**
     * @param {AnswerRequest} request
     * @returns {Promise<{ effects: AnswerEffect[], next: NextFrame | null, answerMs: number }>}
     */
    answer(request: AnswerRequest): Promise<{
        effects: AnswerEffect[];
        next: NextFrame | null;
        answerMs: number;
    }>;
    /**
     * @param {{ id: number }} request
     * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
     */
    maps(request: {
        id: number;
    }): Promise<{
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    }>;
}
