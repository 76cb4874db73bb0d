import type { TargetRequest } from "../engine/engine-worker.js";
import type { AnswerEffect, AnswerRequest, FollowRequest, NextFrame, RawTracked, RawTrackedTarget, TrackerStartRequest, TrackerWorker } from "./tracker-worker.js";
export type ToldFrame = Omit<RawTracked, "targets"> & {
    targets: (RawTrackedTarget & {
        changed: boolean;
    })[];
};
/** A tracker that outlives the death of its worker, with its targets. They are lost then, until the finders see them again. */
export declare class LastingTracker {
    #private;
    /** @param {() => TrackerWorker} create */
    constructor(create: () => TrackerWorker);
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
    untrack({ id }: {
        id: number;
    }): Promise<void>;
    /**
     * @param {FollowRequest} request
     * @returns {Promise<ToldFrame>}
     */
    follow(request: FollowRequest): Promise<ToldFrame>;
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
    /**
     * Ends the worker for good; what is under way rejects with `reason`.
     *
     * @param {unknown} reason
     */
    terminate(reason: unknown): void;
}
