import type { MeshTopology } from "../engine/engine-worker.js";
import type { Position, Quaternion } from "./pose-filter.js";
/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { Position, Quaternion } from "./pose-filter.js" */
/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up stands on the sheet and looks at its reader. In the frame of the vertices it is given; any right-handed one does.
 */
export declare class SurfacePose {
    #private;
    /** mm. @type {Position} */
    position: Position;
    /** (x, y, z, w): from the place's axes to the frame of the vertices. @type {Quaternion} */
    quaternion: Quaternion;
    /**
     * @param {MeshTopology} topology `target.mesh`
     * @param {number} u from the print's left border to its right, 0 to 1
     * @param {number} v from its top to its bottom
     * @param {{ smooth?: boolean }} [options] whether small trembling is filtered out, default true
     * @throws {DeepSftError} `invalid-argument` where the target has no surface
     */
    constructor(topology: MeshTopology, u: number, v: number, { smooth }?: {
        smooth?: boolean;
    });
    /**
     * Moves to another place on the surface, from the next mesh on.
     *
     * @param {number} u
     * @param {number} v
     * @throws {DeepSftError} `invalid-argument` where the target has no surface; it stays where it is then
     */
    place(u: number, v: number): void;
    /**
     * Takes the pose of its place.
     *
     * @param {{ vertices: Float32Array, normals: Float32Array }} mesh (x, y, z) each: a `SurfaceMesh`
     * @param {number} atMs when, milliseconds
     */
    follow({ vertices, normals }: {
        vertices: Float32Array;
        normals: Float32Array;
    }, atMs: number): void;
    /** Takes the next pose at once: the surface was lost. */
    lose(): void;
}
