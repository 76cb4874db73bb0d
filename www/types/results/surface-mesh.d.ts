import type { Camera, MeshTopology } from "../index.js";
import type { RawSurface } from "../../pkg/deepsft_web.js";
export type MeshMethod = "fit" | "completion" | "tracking";
/** @import { Camera, MeshTopology } from "../index.js" */
/** @import { RawSurface } from "../../pkg/deepsft_web.js" */
/**
 * Where a mesh comes from: fitted to one image (`fit`), completed from the finder's maps (`completion`), or followed through a
 * video (`tracking`).
 *
 * @typedef {"fit" | "completion" | "tracking"} MeshMethod
 */
/** A triangle mesh in the camera's frame. */
export declare class SurfaceMesh {
    #private;
    /** (x, y, z) of each vertex, mm (or in the target's `unit`), camera frame: x right, y down, z forward. */
    vertices: Float32Array<ArrayBufferLike>;
    /**
     * How far the image confirms each vertex, 0 to 1: low where nothing is printed, 0 where it is not seen. Of `completion`: 1 where the
     * finder sees the vertex, else 0.
     */
    confidence: Float32Array<ArrayBufferLike>;
    /**
     * Standard deviation of the place of each vertex, mm, along the direction in which it is least sure: what is hidden or blank is
     * loose. Known of a mesh that was fitted to one image; else empty.
     */
    deviations: Float32Array<ArrayBufferLike>;
    /** Three vertex indices per face, counter-clockwise seen from the printed side. The same array for every frame. */
    faces: Uint32Array<ArrayBufferLike>;
    /** (u, v) of each vertex in the template's picture, v down. The same array for every frame. */
    textureCoordinates: Float32Array<ArrayBufferLike>;
    /** Where it comes from. */
    method: MeshMethod;
    /**
     * @param {Omit<RawSurface, "deviations"> & Partial<RawSurface>} raw
     * @param {MeshTopology} topology
     * @param {MeshMethod} method
     */
    constructor({ vertices, confidence, deviations }: Omit<RawSurface, "deviations"> & Partial<RawSurface>, { faces, textureCoordinates, perMm }: MeshTopology, method: MeshMethod);
    /**
     * Unit normals (x, y, z) of the vertices, camera frame: the mean of the faces around each, by their area. They point away
     * from the printed side's back: towards the camera where the print is seen.
     *
     * @returns {Float32Array} computed once
     */
    get normals(): Float32Array;
    /**
     * Where a place of the template's picture is.
     *
     * @param {number} u 0 at the left border, 1 at the right
     * @param {number} v 0 at the top, 1 at the bottom
     * @returns {[number, number, number]} (x, y, z), mm, camera frame
     * @throws {DeepSftError} `invalid-argument` where the target has no surface
     */
    pointAt(u: number, v: number): [number, number, number];
    /**
     * Which place of the template's picture is seen at a pixel, the nearest where the surface lies before itself: where someone taps.
     *
     * @param {number} x pixels of the camera's image
     * @param {number} y
     * @param {Camera} camera `tracked.camera`
     * @returns {[number, number] | null} (u, v); null beside the surface, and where its back is seen
     */
    placeAt(x: number, y: number, camera: Camera): [number, number] | null;
}
/**
 * @param {Float32Array} vertices
 * @param {Uint32Array} faces
 * @param {Float32Array} normals zeros, filled
 * @returns {Float32Array} `normals`
 */
export declare function vertexNormals(vertices: Float32Array, faces: Uint32Array, normals: Float32Array): Float32Array;
