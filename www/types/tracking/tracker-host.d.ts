import type { TargetRequest } from "../engine/engine-worker.js";
import type { AnswerEffect, AnswerRequest, FollowRequest, NextFrame, RawTracked, TrackerStartRequest } from "./tracker-worker.js";
/**
 * @param {TrackerStartRequest} request
 * @returns {Promise<{ value: void, transfer: Transferable[] }>}
 */
export declare function startTracker(request: TrackerStartRequest): Promise<{
    value: void;
    transfer: Transferable[];
}>;
/** @param {TargetRequest} target */
export declare function trackTarget({ id, source }: TargetRequest): Promise<{
    value: undefined;
    transfer: never[];
}>;
/** @param {{ id: number }} request */
export declare function untrackTarget({ id }: {
    id: number;
}): Promise<{
    value: undefined;
    transfer: never[];
}>;
/**
 * @param {FollowRequest} request
 * @returns {Promise<{ value: RawTracked, transfer: Transferable[] }>}
 */
export declare function follow({ timeS, afresh, frame, intrinsics, source, focalDeviation, focal, question }: FollowRequest): Promise<{
    value: RawTracked;
    transfer: Transferable[];
}>;
/**
 * @param {AnswerRequest} request
 * @returns {Promise<{ value: { effects: AnswerEffect[], next: NextFrame | null, answerMs: number }, transfer: Transferable[] }>}
 */
export declare function answer({ answers, tookMs, sinceMissedMs }: AnswerRequest): Promise<{
    value: {
        effects: AnswerEffect[];
        next: NextFrame | null;
        answerMs: number;
    };
    transfer: Transferable[];
}>;
/**
 * @param {{ id: number }} request
 * @returns {Promise<{ value: { width: number, focal: number, depth: Float32Array, registration: Float32Array }, transfer: Transferable[] }>}
 */
export declare function trackedMaps({ id }: {
    id: number;
}): Promise<{
    value: {
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    };
    transfer: Transferable[];
}>;
