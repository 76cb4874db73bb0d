import type { TargetRequest } from "../engine/engine-worker.js";
import type { FinderAnswers, FollowRequest, TrackerStartRequest, TrackerWorker } from "./tracker-host.js";
/** A tracker that outlives the death of its worker, with its targets. They are lost then, until the finders see them again. */
export declare class LastingTracker {
    #private;
    /**
     * @param {() => TrackerWorker} create
     * @param {() => TrackerStartRequest} request what a worker starts with, now
     */
    constructor(create: () => TrackerWorker, request: () => TrackerStartRequest);
    start(): Promise<void>;
    /** @param {TargetRequest} target */
    track(target: TargetRequest): Promise<void | null>;
    /** @param {{ id: number }} request */
    untrack(request: {
        id: number;
    }): Promise<void>;
    /**
     * The meshes in a frame, and which targets are found, or no longer, since they were last told.
     *
     * @param {FollowRequest} request
     */
    follow(request: FollowRequest): Promise<{
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
        targets: {
            id: number;
            copy: number;
            found: boolean;
            held: boolean;
            surface: import("../../pkg/deepsft_web.js").RawSurface | null;
            correlation: number;
            iterations: number;
            changed: boolean;
        }[];
    }>;
    /** @param {FinderAnswers} request */
    answer(request: FinderAnswers): Promise<{
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
    maps(request: {
        id: number;
    }): Promise<{
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    }>;
    /**
     * Ends the worker for good; what is under way rejects with `reason`.
     *
     * @param {unknown} reason
     */
    terminate(reason: unknown): void;
}
