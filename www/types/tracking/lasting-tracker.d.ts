import type { TargetRequest } from "../engine/engine-worker.js";
import type { FollowRequest } from "./tracker-host.js";
import type { TrackerStartRequest, TrackerWorker } from "./tracker-worker.js";
/** A tracker that outlives the death of its worker, with its targets. They are lost then, until the finders see them again. */
export declare class LastingTracker {
    #private;
    /** @param {() => TrackerWorker} create */
    constructor(create: () => TrackerWorker);
    /** @param {TrackerStartRequest} request */
    start(request: TrackerStartRequest): Promise<void>;
    /** @param {TargetRequest} target */
    track(target: TargetRequest): Promise<void>;
    /** @param {{ id: number }} request */
    untrack({ id }: {
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
    /** @param {Parameters<TrackerWorker["answer"]>[0]} request */
    answer(request: Parameters<TrackerWorker["answer"]>[0]): Promise<{
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
