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
