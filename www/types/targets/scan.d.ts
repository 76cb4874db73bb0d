import type { readScan } from "../../pkg/deepsft_web.js";
export type ScanInput = string | URL | File | Iterable<File> | Map<string, Uint8Array>;
/** @import { readScan } from "../../pkg/deepsft_web.js" */
/**
 * The files of a scan: the address of a `.glb` or `.zip`, one file, several as a file input gives them, or the files by name. A `.glb` is
 * one file, a `.zip` holds all. A `.obj` comes with its `.mtl` and pictures, or with one picture; a `.gltf` and a `.ply` with what they name.
 *
 * @typedef {string | URL | File | Iterable<File> | Map<string, Uint8Array>} ScanInput
 */
/** A scan. `DeepSft` reads it. */
export declare class Scan {
    /** Its files, by name. */
    files: Map<string, Uint8Array<ArrayBufferLike>>;
    /** Name of its file. */
    name: string;
    /** Millimetres of the file's unit, as they were taken. */
    mmPerUnit: number;
    /** (x, y, z) of each vertex, mm: x right, y down, the front towards -z; its middle is the origin. */
    vertices: Float32Array<ArrayBufferLike>;
    /** Unit normals (x, y, z) of the vertices. */
    normals: Float32Array<ArrayBufferLike>;
    /** Faces and texture coordinates. */
    mesh: {
        faces: Uint32Array;
        textureCoordinates: Float32Array;
    };
    /** Its texture. */
    texture: ImageData;
    /**
     * The flat sheet that it unrolls to: what is looked for. `backMm` is how far its back is away, which the scan has too and which was
     * left out, or null. Null of an object with a volume.
     *
     * @type {{ picture: ImageData, widthMm: number, heightMm: number, backMm: number | null } | null}
     */
    sheet: {
        picture: ImageData;
        widthMm: number;
        heightMm: number;
        backMm: number | null;
    } | null;
    /** Why it is no sheet but an object with a volume, for people; null of a sheet. */
    refusal: string | null;
    /** What was put right, left out or made anew, for people. */
    notes: string[];
    /**
     * @param {Awaited<ReturnType<typeof readScan>>} raw
     * @param {Map<string, Uint8Array>} files
     */
    constructor({ name, mmPerUnit, vertices, mesh, texture, sheet, refusal, notes }: Awaited<ReturnType<typeof readScan>>, files: Map<string, Uint8Array>);
    /** Sides of the box around it, mm: width, height and depth. @returns {[number, number, number]} */
    get sizeMm(): [number, number, number];
}
/**
 * @param {ScanInput} input
 * @returns {Promise<Map<string, Uint8Array>>} by name; archives unpacked
 * @throws {import("../error.js").DeepSftError} `model-load`, `target-unusable`
 */
export declare function scanFiles(input: ScanInput): Promise<Map<string, Uint8Array>>;
