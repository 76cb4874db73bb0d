import { WorkerCalls } from "../engine/worker-calls.js";
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
    number: number;
    timeS: number;
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
    focal?: number;
    calibrate?: boolean;
};
export type AnswerRequest = RawAnswer & {
    number: number;
};
export type Verdict = "started" | "confirmed" | "restarted" | "dropped" | "ignored";
export type RawTrackedTarget = {
    id: number;
    found: boolean;
    vertices: Float32Array;
    confidence: Float32Array;
    correlation: number;
    iterations: number;
};
export type RawTracked = {
    targets: RawTrackedTarget[];
    /**
     * the true focal length as a multiple of the given one, where it was
     * found, and its standard deviation as a fraction
     */
    focal: {
        ratio: number;
        deviation: number;
    } | null;
    times: {
        warpMs: number;
        trackMs: number;
    };
    /**
     * time to read the frame's pixels
     */
    readMs: number;
};
/** @import { RawAnswer, TargetRequest } from "../engine/engine-worker.js" */
/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */
/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */
/** @typedef {{ number: number, timeS: number, frame: ImageBitmap | ImageData, intrinsics: number[], focal?: number, calibrate?: boolean }} FollowRequest `focal`: of the canonical image, pixels; the training camera's when absent */
/** @typedef {RawAnswer & { number: number }} AnswerRequest what the finders say of one target in a frame, by its number */
/**
 * What the tracker made of an answer of the finders.
 *
 * @typedef {"started" | "confirmed" | "restarted" | "dropped" | "ignored"} Verdict
 */
/**
 * One target in a frame: `vertices` and `confidence` are empty unless found.
 *
 * @typedef {{ id: number, found: boolean, vertices: Float32Array, confidence: Float32Array, correlation: number, iterations: number }} RawTrackedTarget
 */
/**
 * The meshes in one frame as they cross from the worker.
 *
 * @typedef {object} RawTracked
 * @property {RawTrackedTarget[]} targets
 * @property {{ ratio: number, deviation: number } | null} focal the true focal length as a multiple of the given one, where it was
 *   found, and its standard deviation as a fraction
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
     * @param {{ id: number }} request
     * @returns {Promise<void>}
     */
    unfollow(request: {
        id: number;
    }): Promise<void>;
    /**
     * @param {FollowRequest} request
     * @returns {Promise<RawTracked>}
     */
    follow(request: FollowRequest): Promise<RawTracked>;
    /**
     * @param {AnswerRequest} request
     * @returns {Promise<{ verdict: Verdict, answerMs: number }>}
     */
    answer(request: AnswerRequest): Promise<{
        verdict: Verdict;
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
