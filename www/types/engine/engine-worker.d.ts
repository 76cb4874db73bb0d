import { WorkerCalls } from "./worker-calls.js";
import type { CameraSource } from "../camera/intrinsics.js";
import type { RawEstimate as EngineEstimate, RawFlatPrint, RawMesh } from "../../pkg/deepsft_web.js";
import type { LoadProgress } from "./bundle.js";
import type { DeepSftErrorCode } from "../error.js";
import type { RawScan } from "../targets/scan.js";
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
export type EngineTimes = EngineEstimate["times"];
export type FinderName = NonNullable<EngineEstimate["by"]>;
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
export type TargetDescription = {
    width: number;
    height: number;
    rgba: Uint8ClampedArray<ArrayBuffer>;
    sizeMm: [number, number];
    mesh: MeshTopology;
    grade: PictureGrade | null;
};
export type AddedTarget = TargetDescription & {
    alike: {
        id: number;
        share: number;
    }[];
};
export type StartRequest = {
    module: WebAssembly.Module;
    files: Map<string, Uint8Array> | null;
    device: "auto" | "webgpu" | "cpu";
};
export type TargetRequest = {
    id: number;
    source: TargetSource;
};
export type PhotographRequest = {
    file: Blob;
    width: number;
    height: number;
};
export type ScanRequest = {
    files: Map<string, Uint8Array>;
    mmPerUnit: number | undefined;
};
export type EstimateRequest = {
    id: number;
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
    source: CameraSource;
    fit: boolean;
};
export type FlattenRequest = {
    id: number;
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
    source: CameraSource;
    columns: number;
    unshaded: boolean;
};
export type FindRequest = {
    ids: number[];
    estimated: boolean;
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
    focal: number;
};
export type RawAnswer = {
    id: number;
    sightings: Float32Array[];
};
export type RawFinding = {
    answers: RawAnswer[];
    estimate: RawEstimate | null;
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
 * @returns {Promise<WebAssembly.Module>}
 * @throws {DeepSftError} `engine-load`
 */
export declare function compileEngine(url: URL, { onProgress, signal }?: {
    onProgress?: (progress: LoadProgress) => void;
    signal?: AbortSignal;
}): Promise<WebAssembly.Module>;
/** The worker that finds targets. */
export declare class EngineWorker extends WorkerCalls {
    /**
     * @param {StartRequest} request
     * @returns {Promise<{ info: EngineInfo, model: TargetDescription | null }>}
     */
    start(request: StartRequest): Promise<{
        info: EngineInfo;
        model: TargetDescription | null;
    }>;
    /**
     * @param {TargetRequest} request
     * @returns {Promise<AddedTarget>}
     */
    addTarget(request: TargetRequest): Promise<AddedTarget>;
    /**
     * @param {{ id: number }} request
     * @returns {Promise<void>}
     */
    removeTarget(request: {
        id: number;
    }): Promise<void>;
    /**
     * @param {ScanRequest} request
     * @returns {Promise<RawScan>}
     */
    readScan(request: ScanRequest): Promise<RawScan>;
    /**
     * @param {FindRequest} request
     * @returns {Promise<RawFinding>}
     */
    find(request: FindRequest): Promise<RawFinding>;
    /**
     * @param {PhotographRequest} request
     * @returns {Promise<number | undefined>} the focal length that the file's EXIF data tell, pixels
     */
    exifFocal(request: PhotographRequest): Promise<number | undefined>;
    /**
     * @param {EstimateRequest} request
     * @returns {Promise<RawEstimate>}
     */
    estimate(request: EstimateRequest): Promise<RawEstimate>;
    /**
     * @param {FlattenRequest} request
     * @returns {Promise<RawFlatPrint | null>} null when it is not found
     */
    flatten(request: FlattenRequest): Promise<RawFlatPrint | null>;
    /**
     * @param {MeshRequest} request
     * @returns {Promise<RawMesh | null>} null when the maps show too little of the template
     */
    mesh(request: MeshRequest): Promise<RawMesh | null>;
}
/** @param {ImageBitmap | ImageData} frame */
export declare function transferable(frame: ImageBitmap | ImageData): ArrayBuffer | ImageBitmap;
