import { BufferGeometry } from "three";
import type { MeshTopology } from "../engine/engine-worker.js";
/** @import { MeshTopology } from "../engine/engine-worker.js" */
/**
 * The mesh of a target in the frame of three.js, mm. Faces are counter-clockwise seen from the printed side. `uv` has v up, as textures
 * of three.js do.
 */
export declare class SurfaceGeometry extends BufferGeometry {
    #private;
    /** @param {MeshTopology} topology `target.mesh` */
    constructor({ faces, textureCoordinates }: MeshTopology);
    /**
     * Takes the shape of a mesh; nothing is allocated.
     *
     * @param {{ vertices: Float32Array, faces: Uint32Array }} mesh a `SurfaceMesh` of the same target
     * @throws {DeepSftError} `invalid-argument` for the mesh of another target
     */
    update({ vertices, faces }: {
        vertices: Float32Array;
        faces: Uint32Array;
    }): void;
}
/**
 * The one conversion between our frame and that of three.js: points or directions of the camera's frame (x right, y down, z forward) in
 * that of a camera of three.js (x right, y up, z backward), or back: half a turn about x is its own inverse. Lengths stay, so a unit is a
 * millimetre in both.
 *
 * @param {Float32Array} from (x, y, z) each
 * @param {Float32Array} [to] filled; `from` itself when absent
 * @returns {Float32Array} `to`
 */
export declare function turnedFrame(from: Float32Array, to?: Float32Array): Float32Array;
