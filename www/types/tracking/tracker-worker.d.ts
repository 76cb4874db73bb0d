import { WorkerCalls } from "../engine/worker-calls.js";
import type { TargetRequest } from "../engine/engine-worker.js";
export type Smoothing = {
    minCutoff?: number;
    beta?: number;
};
export type TrackerStartRequest = {
    module: WebAssembly.Module;
    targets: TargetRequest[];
    smooth: Smoothing | null;
};
/** @import { TargetRequest } from "../engine/engine-worker.js" */
/**
 * The One-Euro filter of each vertex (Casiez, Roussel and Vogel 2012): a low-pass with the cut-off `minCutoff` (Hz, default 2)
 * for a vertex at rest. The cut-off rises by `beta` (Hz per mm/s, default 0.1) with the vertex's speed, so that motion hardly
 * lags.
 *
 * @typedef {{ minCutoff?: number, beta?: number }} Smoothing
 */
/** @typedef {{ module: WebAssembly.Module, targets: TargetRequest[], smooth: Smoothing | null }} TrackerStartRequest */
/** The worker that follows meshes. @extends {WorkerCalls<typeof import("./tracker-host.js")>} */
export declare class TrackerWorker extends WorkerCalls<typeof import("./tracker-host.js")> {
    start: (request: TrackerStartRequest) => Promise<void>;
    track: (request: TargetRequest) => Promise<void>;
    untrack: (request: {
        id: number;
    }) => Promise<void>;
    follow: (request: import("./tracker-host.js").FollowRequest) => Promise<{
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
    answer: (request: {
        answers: import("../engine/engine-worker.js").RawAnswer[];
        tookMs: number;
        sinceMissedMs: number;
    }) => Promise<{
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
    maps: (request: {
        id: number;
    }) => Promise<{
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    }>;
}
