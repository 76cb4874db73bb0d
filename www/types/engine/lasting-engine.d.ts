import { DeepSftError } from "../error.js";
import type { EngineInfo, EngineWorker, StartRequest, TargetDescription } from "./engine-worker.js";
import type { TargetSource } from "../targets/target-source.js";
export type StartPlan = {
    request: StartRequest;
    workerUrl: URL | undefined;
    timeoutMs: number | undefined;
};
export type StartedEngine = {
    worker: EngineWorker;
    info: EngineInfo;
    model: TargetDescription | null;
};
/** An engine that outlives the loss of its GPU and the death of its worker, with its targets. */
export declare class LastingEngine {
    #private;
    plan: StartPlan;
    info: EngineInfo;
    /** The model's target; null without a model. */
    model: {
        width: number;
        height: number;
        rgba: Uint8ClampedArray<ArrayBuffer>;
        sizeMm: [number, number];
        mesh: {
            faces: Uint32Array;
            textureCoordinates: Float32Array;
        };
        grade: {
            level: "hopeless" | "poor" | "fair" | "good";
            reasons: string[];
        } | null;
    } | null;
    /** What its targets are made of, by number. @type {Map<number, TargetSource>} */
    sources: Map<number, TargetSource>;
    closed: boolean;
    /**
     * @param {StartPlan} plan
     * @param {StartedEngine} started with it
     */
    constructor(plan: StartPlan, { worker, info, model }: StartedEngine);
    /** @param {number} id */
    removeTarget(id: number): void;
    /** Stops the worker; what is under way rejects with `closed`. */
    close(): void;
    /**
     * Has the engine do something; where it loses its GPU or its worker meanwhile, once more after it has been started again.
     *
     * @template T
     * @param {(worker: EngineWorker) => Promise<T>} work
     */
    run<T>(work: (worker: EngineWorker) => Promise<T>): Promise<T>;
}
/**
 * Starts a worker and its engine; under `auto`, when WebGPU promised well but the engine could not start on it, once
 * more on the CPU, in a fresh worker.
 *
 * @param {StartPlan} plan
 * @param {AbortSignal | undefined} signal
 * @returns {Promise<StartedEngine>}
 */
export declare function startEngine({ request, workerUrl, timeoutMs }: StartPlan, signal: AbortSignal | undefined): Promise<StartedEngine>;
export declare function closedError(): DeepSftError;
