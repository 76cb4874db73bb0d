import type { DeepSftErrorCode, LoadOptions } from "../index.js";
import type { Engine, RawEstimate as EngineEstimate } from "../../pkg/deepsft_web.js";
import type { TargetSource } from "../targets/target-source.js";
import type { WorkerCalls } from "./worker-calls.js";
export type EngineWorker = WorkerCalls<typeof import("./engine-host.js")>;
export type EngineInfo = {
    device: "webgpu" | "cpu";
    /**
     * the GPU adapter's name, or what runs on the CPU
     */
    adapterName: string;
    /**
     * whether a WebGPU adapter is emulated on the CPU
     */
    software: boolean;
    /**
     * null without a model
     */
    modelName: string | null;
    /**
     * of the network; 0 without a model
     */
    parameters: number;
    /**
     * of this package
     */
    version: string;
    /**
     * why `device: "auto"` took the CPU
     */
    fallback: {
        code: DeepSftErrorCode;
        message: string;
    } | null;
};
export type RawEstimate = EngineEstimate & {
    readMs: number;
    bitmap: ImageBitmap | null;
};
export type MeshTopology = {
    faces: Uint32Array;
    textureCoordinates: Float32Array;
    perMm?: number;
};
export type PictureGrade = {
    level: "hopeless" | "poor" | "fair" | "good";
    reasons: string[];
};
export type TargetDescription = NonNullable<ReturnType<Engine["describeTarget"]>>;
export type StartRequest = {
    module: WebAssembly.Module;
    files: Map<string, Uint8Array> | null;
    device: "auto" | "webgpu" | "cpu";
};
export type TargetRequest = {
    id: number;
    source: TargetSource;
};
export type RawAnswer = {
    id: number;
    sightings: Float32Array[];
};
export type MeshRequest = {
    id: number;
    width: number;
    focal: number;
    depth: Float32Array;
    registration: Float32Array;
    canonical: Uint8ClampedArray | null;
};
/**
 * Compiles the WebAssembly module while it downloads.
 *
 * Browsers keep compiled code beside the response it came from, so the response itself is compiled, and its bytes are
 * counted on a copy.
 *
 * @param {URL} url
 * @param {Pick<LoadOptions, "onProgress" | "signal">} [options]
 * @throws {DeepSftError} `engine-load`
 */
export declare function compileEngine(url: URL, { onProgress, signal }?: Pick<LoadOptions, "onProgress" | "signal">): Promise<WebAssembly.Module>;
