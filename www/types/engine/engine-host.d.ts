import type { CameraSource } from "../camera/intrinsics.js";
import type { EngineInfo, MeshRequest, RawEstimate, StartRequest, TargetRequest } from "./engine-worker.js";
export type Looked = {
    frame: ImageBitmap | ImageData;
    intrinsics: number[];
};
/** @param {StartRequest} request */
export declare function start({ module, files, device: wanted }: StartRequest): Promise<{
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
/** @param {TargetRequest} request */
export declare function addTarget({ id, source }: TargetRequest): Promise<{
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
/** @param {{ id: number }} request */
export declare function removeTarget({ id }: {
    id: number;
}): void;
/**
 * The focal length that a photograph's EXIF data tell, pixels.
 *
 * @param {{ file: Blob, width: number, height: number }} request with the size of the picture as it is shown
 */
export declare function exifFocal({ file, width, height }: {
    file: Blob;
    width: number;
    height: number;
}): Promise<number | undefined>;
/** @param {{ files: Map<string, Uint8Array>, mmPerUnit: number | undefined }} request */
export declare function readScan({ files, mmPerUnit }: {
    files: Map<string, Uint8Array>;
    mmPerUnit: number | undefined;
}): Promise<{
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
/** @param {Looked & { id: number, source: CameraSource, fit: boolean }} request whose bitmap is handed back */
export declare function estimate({ id, frame, intrinsics, source, fit }: Looked & {
    id: number;
    source: CameraSource;
    fit: boolean;
}): Promise<RawEstimate>;
/** @param {Looked & { ids: number[], estimated: boolean, focal: number }} request with the canonical image's focal length, pixels */
export declare function find({ ids, estimated, frame, intrinsics, focal }: Looked & {
    ids: number[];
    estimated: boolean;
    focal: number;
}): Promise<{
    answers: {
        id: number;
        sightings: Float32Array[];
    }[];
    estimate: {
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
        mask: Uint8Array;
        canonical: Uint8ClampedArray;
        found: boolean;
        confidence: number;
        shapeDetermined: boolean;
        by: "network" | "features" | null;
        told: number[] | null;
        fitted: import("../../pkg/deepsft_web.js").RawMesh | null;
        times: {
            warpMs: number;
            networkMs: number;
            judgeMs: number;
            featuresMs: number;
        };
        readMs: number;
        bitmap: null;
    } | null;
}>;
/** @param {Looked & { id: number, source: CameraSource, columns: number, unshaded: boolean }} request */
export declare function flatten({ id, frame, intrinsics, source, columns, unshaded }: Looked & {
    id: number;
    source: CameraSource;
    columns: number;
    unshaded: boolean;
}): Promise<import("../../pkg/deepsft_web.js").RawFlatPrint | null>;
/** @param {MeshRequest} request */
export declare function mesh({ id, width, focal, depth, registration, canonical }: MeshRequest): Promise<import("../../pkg/deepsft_web.js").RawMesh | null>;
