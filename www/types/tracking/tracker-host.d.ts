import type { MeshTopology } from "../engine/engine-worker.js";
import type { AnswerRequest, FollowRequest, RawTracked, TrackerStartRequest, Verdict } from "./tracker-worker.js";
/**
 * @param {TrackerStartRequest} request
 * @returns {Promise<{ value: MeshTopology, transfer: Transferable[] }>}
 */
export declare function startTracker({ module, files, smooth }: TrackerStartRequest): Promise<{
    value: MeshTopology;
    transfer: Transferable[];
}>;
/**
 * @param {FollowRequest} request
 * @returns {Promise<{ value: RawTracked, transfer: Transferable[] }>}
 */
export declare function follow({ number, timeS, frame, intrinsics }: FollowRequest): Promise<{
    value: RawTracked;
    transfer: Transferable[];
}>;
/**
 * @param {AnswerRequest} request
 * @returns {Promise<{ value: { verdict: Verdict, answerMs: number }, transfer: Transferable[] }>}
 */
export declare function answer({ number, depth, registration }: AnswerRequest): Promise<{
    value: {
        verdict: Verdict;
        answerMs: number;
    };
    transfer: Transferable[];
}>;
/** @returns {{ value: { depth: Float32Array, registration: Float32Array }, transfer: Transferable[] }} */
export declare function trackedMaps(): {
    value: {
        depth: Float32Array;
        registration: Float32Array;
    };
    transfer: Transferable[];
};
