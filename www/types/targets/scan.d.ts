import type { MeshTopology } from "../engine/engine-worker.js";
export type ScanInput = string | URL | File | Iterable<File> | Map<string, Uint8Array>;
export type RawPicture = {
    width: number;
    height: number;
    rgba: Uint8ClampedArray<ArrayBuffer>;
};
export type RawScan = {
    name: string;
    mmPerUnit: number;
    vertices: Float32Array;
    mesh: MeshTopology;
    texture: RawPicture;
    sheet: {
        sizeMm: [number, number];
        backMm: number | null;
        picture: RawPicture;
    } | null;
    refusal: string | null;
    notes: string[];
};
/** @import { MeshTopology } from "../engine/engine-worker.js" */
/**
 * The files of a scan: the address of a `.glb` or `.zip`, one file, several as a file input gives them, or the files by name. A `.glb` is
 * one file, a `.zip` holds all. A `.obj` comes with its `.mtl` and pictures, or with one picture; a `.gltf` and a `.ply` with what they name.
 *
 * @typedef {string | URL | File | Iterable<File> | Map<string, Uint8Array>} ScanInput
 */
/** @typedef {{ width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer> }} RawPicture */
/**
 * A scan as it crosses from the worker.
 *
 * @typedef {object} RawScan
 * @property {string} name
 * @property {number} mmPerUnit
 * @property {Float32Array} vertices
 * @property {MeshTopology} mesh
 * @property {RawPicture} texture
 * @property {{ sizeMm: [number, number], backMm: number | null, picture: RawPicture } | null} sheet
 * @property {string | null} refusal
 * @property {string[]} notes
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
    mesh: MeshTopology;
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
     * @param {RawScan} raw
     * @param {Map<string, Uint8Array>} files
     */
    constructor({ name, mmPerUnit, vertices, mesh, texture, sheet, refusal, notes }: RawScan, files: Map<string, Uint8Array>);
    /** Sides of the box around it, mm: width, height and depth. @returns {[number, number, number]} */
    get sizeMm(): [number, number, number];
}
/**
 * @param {ScanInput} input
 * @returns {Promise<Map<string, Uint8Array>>} by name; archives unpacked
 * @throws {import("../error.js").DeepSftError} `model-load`, `target-unusable`
 */
export declare function scanFiles(input: ScanInput): Promise<Map<string, Uint8Array>>;
