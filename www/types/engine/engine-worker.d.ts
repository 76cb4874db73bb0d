import { WorkerCalls } from "./worker-calls.js";
import type { RawEstimate as EngineEstimate, RawMesh } from "../../pkg/deepsft_web.js";
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
    fit: boolean;
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
/** @import { RawEstimate as EngineEstimate, RawMesh } from "../../pkg/deepsft_web.js" */
/** @import { LoadProgress } from "./bundle.js" */
/** @import { DeepSftErrorCode } from "../error.js" */
/** @import { RawScan } from "../targets/scan.js" */
/** @import { TargetSource } from "../targets/target-source.js" */
/**
 * What runs the network.
 *
 * @typedef {object} EngineInfo
 * @property {"webgpu" | "cpu"} device
 * @property {string} adapterName the GPU adapter's name, or what runs on the CPU
 * @property {boolean} software whether a WebGPU adapter is emulated on the CPU
 * @property {string | null} modelName null without a model
 * @property {number} parameters of the network; 0 without a model
 * @property {string} version of this package
 * @property {{ code: DeepSftErrorCode, message: string } | null} fallback why `device: "auto"` took the CPU
 */
/**
 * Milliseconds in the engine: canonical warp, network, confidence, and finding by features, its fit included.
 *
 * @typedef {EngineEstimate["times"]} EngineTimes
 */
/** @typedef {NonNullable<EngineEstimate["by"]>} FinderName */
/**
 * The maps of one frame as they cross from the worker: with the time to read the frame's pixels, and the frame where it is handed back.
 *
 * @typedef {EngineEstimate & { readMs: number, bitmap: ImageBitmap | null }} RawEstimate
 */
/**
 * What of a mesh no frame changes: three vertex indices per face, counter-clockwise seen from the front, and (u, v) of each
 * vertex.
 *
 * `perMm` is there where the print's size is not known: a millimetre of the engine's in units of its width.
 *
 * @typedef {{ faces: Uint32Array, textureCoordinates: Float32Array, perMm?: number }} MeshTopology
 */
/**
 * How well a print will be found: `good`, `fair` (lost in hard views), `poor` (found now and then, or mistaken), or `hopeless`. The
 * reasons are sentences for people, the worst first; none where nothing is wrong.
 *
 * @typedef {{ level: "hopeless" | "poor" | "fair" | "good", reasons: string[] }} PictureGrade
 */
/** @typedef {{ width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer>, sizeMm: [number, number], mesh: MeshTopology, grade: PictureGrade | null }} TargetDescription */
/** @typedef {{ module: WebAssembly.Module, files: Map<string, Uint8Array> | null, device: "auto" | "webgpu" | "cpu" }} StartRequest */
/** @typedef {{ id: number, source: TargetSource }} TargetRequest */
/** @typedef {{ file: Blob, width: number, height: number }} PhotographRequest the size of the picture as it is shown */
/** @typedef {{ files: Map<string, Uint8Array>, mmPerUnit: number | undefined }} ScanRequest */
/** @typedef {{ id: number, frame: ImageBitmap | ImageData, intrinsics: number[], fit: boolean }} EstimateRequest intrinsics are fx, fy, cx, cy, k1, k2, p1, p2, k3 */
/** @typedef {{ ids: number[], estimated: boolean, frame: ImageBitmap | ImageData, intrinsics: number[], focal: number }} FindRequest `focal`: of the canonical image, pixels */
/**
 * What the finders say of one target in a frame: the vertices of its mesh (x, y, z each, camera frame, mm), the likeliest first.
 *
 * @typedef {{ id: number, sightings: Float32Array[] }} RawAnswer
 */
/** @typedef {{ answers: RawAnswer[], estimate: RawEstimate | null }} RawFinding the estimate is that of the model's network */
/**
 * With the canonical image: a mesh fitted to it. Without: ARAP completion of the maps.
 *
 * @typedef {{ id: number, width: number, focal: number, depth: Float32Array, registration: Float32Array, canonical: Uint8ClampedArray | null }} MeshRequest
 */
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
     * @returns {Promise<TargetDescription>}
     */
    addTarget(request: TargetRequest): Promise<TargetDescription>;
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
     * @param {MeshRequest} request
     * @returns {Promise<RawMesh | null>} null when the maps show too little of the template
     */
    mesh(request: MeshRequest): Promise<RawMesh | null>;
}
/** @param {ImageBitmap | ImageData} frame */
export declare function transferable(frame: ImageBitmap | ImageData): ArrayBuffer | ImageBitmap;
