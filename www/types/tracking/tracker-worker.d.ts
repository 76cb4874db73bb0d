import { WorkerCalls } from "../engine/worker-calls.js";
import type { MeshTopology } from "../engine/engine-worker.js";
export type Smoothing = {
    minCutoff?: number;
    beta?: number;
};
export type TrackerStartRequest = {
    module: WebAssembly.Module;
    files: Map<string, Uint8Array>;
    smooth: Smoothing | null;
};
export type FollowRequest = {
    number: number;
    timeS: number;
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
};
export type AnswerRequest = {
    number: number;
    depth: Float32Array;
    registration: Float32Array;
};
export type Verdict = "started" | "confirmed" | "restarted" | "dropped" | "ignored";
export type RawTracked = {
    found: boolean;
    vertices: Float32Array;
    confidence: Float32Array;
    agreement: number;
    iterations: number;
    times: {
        warpMs: number;
        trackMs: number;
    };
    /**
     * time to read the frame's pixels
     */
    readMs: number;
    /**
     * the frame, handed back
     */
    bitmap: ImageBitmap | null;
};
/** @import { MeshTopology } from "../engine/engine-worker.js" */
/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */
/** @typedef {{ module: WebAssembly.Module, files: Map<string, Uint8Array>, smooth: Smoothing | null }} TrackerStartRequest */
/** @typedef {{ number: number, timeS: number, frame: ImageBitmap | ImageData, intrinsics: number[] }} FollowRequest */
/** @typedef {{ number: number, depth: Float32Array, registration: Float32Array }} AnswerRequest both empty: not found */
/**
 * What the tracker made of the network's answer.
 *
 * @typedef {"started" | "confirmed" | "restarted" | "dropped" | "ignored"} Verdict
 */
/**
 * The mesh in one frame as it crosses from the worker.
 *
 * @typedef {object} RawTracked
 * @property {boolean} found
 * @property {Float32Array} vertices
 * @property {Float32Array} confidence
 * @property {number} agreement
 * @property {number} iterations
 * @property {{ warpMs: number, trackMs: number }} times
 * @property {number} readMs time to read the frame's pixels
 * @property {ImageBitmap | null} bitmap the frame, handed back
 */
/** The worker that follows the mesh. */
export declare class TrackerWorker extends WorkerCalls {
    /**
     * @param {TrackerStartRequest} request
     * @returns {Promise<MeshTopology>}
     */
    start(request: TrackerStartRequest): Promise<MeshTopology>;
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
    /** @returns {Promise<{ depth: Float32Array, registration: Float32Array }>} */
    maps(): Promise<{
        depth: Float32Array;
        registration: Float32Array;
    }>;
}
