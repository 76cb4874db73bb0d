import { WorkerCalls } from "./worker-calls.js";
import type { Engine, RawEstimate as EngineEstimate } from "../../pkg/deepsft_web.js";
import type { LoadProgress } from "./bundle.js";
import type { DeepSftErrorCode } from "../error.js";
import type { TargetSource } from "../targets/target-source.js";
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
 * @param {object} [options]
 * @param {(progress: LoadProgress) => void} [options.onProgress]
 * @param {AbortSignal} [options.signal]
 * @throws {DeepSftError} `engine-load`
 */
export declare function compileEngine(url: URL, { onProgress, signal }?: {
    onProgress?: (progress: LoadProgress) => void;
    signal?: AbortSignal;
}): Promise<WebAssembly.Module>;
/** The worker that finds targets. @extends {WorkerCalls<typeof import("./engine-host.js")>} */
export declare class EngineWorker extends WorkerCalls<typeof import("./engine-host.js")> {
    start: (request: StartRequest) => Promise<{
        info: EngineInfo;
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
    }>;
    addTarget: (request: TargetRequest) => Promise<{
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
    removeTarget: (request: {
        id: number;
    }) => Promise<void>;
    readScan: (request: {
        files: Map<string, Uint8Array>;
        mmPerUnit: number | undefined;
    }) => Promise<{
        name: string;
        mmPerUnit: number;
        vertices: Float32Array;
        mesh: {
            faces: Uint32Array;
            textureCoordinates: Float32Array;
        };
        texture: {
            width: number;
            height: number;
            rgba: Uint8ClampedArray<ArrayBuffer>;
        };
        sheet: {
            sizeMm: [number, number];
            backMm: number | null;
            picture: {
                width: number;
                height: number;
                rgba: Uint8ClampedArray<ArrayBuffer>;
            };
        } | null;
        refusal: string | null;
        notes: string[];
    }>;
    exifFocal: (request: {
        file: Blob;
        width: number;
        height: number;
    }) => Promise<number | undefined>;
    find: (request: import("./engine-host.js").Looked & {
        ids: number[];
        estimated: boolean;
        focal: number;
    }) => Promise<{
        answers: {
            id: number;
            sightings: Float32Array[];
        }[];
        estimate: RawEstimate | null;
    }>;
    estimate: (request: import("./engine-host.js").Looked & {
        id: number;
        source: import("../camera/intrinsics.js").CameraSource;
        fit: boolean;
    }) => Promise<EngineEstimate & {
        readMs: number;
        bitmap: ImageBitmap | null;
    }>;
    flatten: (request: import("./engine-host.js").Looked & {
        id: number;
        source: import("../camera/intrinsics.js").CameraSource;
        columns: number;
        unshaded: boolean;
    }) => Promise<import("../../pkg/deepsft_web.js").RawFlatPrint | null>;
    mesh: (request: MeshRequest) => Promise<import("../../pkg/deepsft_web.js").RawMesh | null>;
}
