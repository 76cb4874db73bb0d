import { DeepSftError } from "../error.js";
import { EngineWorker } from "./engine-worker.js";
import type { EngineInfo, StartRequest, TargetDescription } from "./engine-worker.js";
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
    /** The model's target, number 0; null without a model. */
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
    /**
     * Use {@link LastingEngine.start}.
     *
     * @param {StartPlan} plan
     * @param {StartedEngine} started
     */
    constructor(plan: StartPlan, { worker, info, model }: StartedEngine);
    /**
     * @param {StartPlan} plan
     * @param {AbortSignal | undefined} signal
     * @throws {DeepSftError}
     */
    static start(plan: StartPlan, signal: AbortSignal | undefined): Promise<LastingEngine>;
    get info(): EngineInfo;
    get closed(): boolean;
    /**
     * @param {number} id
     * @param {TargetSource} source
     * @throws {DeepSftError} `target-unusable`, `model-version`, `closed`
     */
    addTarget(id: number, source: TargetSource): Promise<{
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
        alike: {
            id: number;
            share: number;
        }[];
    }>;
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
export declare function closedError(): DeepSftError;
