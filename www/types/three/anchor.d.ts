import { Group } from "three";
import type { MeshTopology } from "../engine/engine-worker.js";
import type { SurfaceGeometry } from "./surface-geometry.js";
/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { SurfaceGeometry } from "./surface-geometry.js" */
/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up, like most models, stands on the sheet and looks at its reader. Units are millimetres.
 */
export declare class Anchor extends Group {
    #private;
    /**
     * Use `sheet.anchor`.
     *
     * @param {MeshTopology} topology
     * @param {number} u
     * @param {number} v
     * @param {{ smooth?: boolean }} [options] whether small trembling is filtered out, default true
     * @throws {RangeError} where the target has no surface
     */
    constructor(topology: MeshTopology, u: number, v: number, options?: {
        smooth?: boolean;
    });
    /**
     * Moves to another place on the surface, from the next frame on.
     *
     * @param {number} u
     * @param {number} v
     * @throws {RangeError} where the target has no surface; the anchor stays where it is then
     */
    place(u: number, v: number): void;
    /**
     * Takes the pose of its place; the sheet calls it.
     *
     * @param {SurfaceGeometry} geometry of the topology
     * @param {number} atMs
     */
    follow(geometry: SurfaceGeometry, atMs: number): void;
    /** Is invisible until the next pose, which it takes at once; the sheet calls it. */
    lose(): void;
}
