import { Group, Mesh, MeshBasicMaterial } from "three";
import { Anchor } from "./anchor.js";
import { SurfaceGeometry } from "./surface-geometry.js";
import type { Material, Texture } from "three";
import type { SurfaceMesh } from "../results/surface-mesh.js";
import type { TrackedFrame } from "../results/tracked-frame.js";
import type { Target } from "../targets/target.js";
export type SheetOptions = {
    /**
     * a new print, upright like any texture of three.js: a picture, a canvas, a video. It is lit as the real
     * paper is, and where something lies before the paper it is left out.
     */
    map?: Texture;
    /**
     * a material of one's own in place of that; with `vertexColors` the light of the paper is multiplied into
     * its colours
     */
    material?: Material;
};
/**
 * @typedef {object} SheetOptions
 * @property {Texture} [map] a new print, upright like any texture of three.js: a picture, a canvas, a video. It is lit as the real
 *   paper is, and where something lies before the paper it is left out.
 * @property {Material} [material] a material of one's own in place of that; with `vertexColors` the light of the paper is multiplied into
 *   its colours
 */
/** The surface of a target. It has its place in the camera's frame: add it to the scene, or to the camera if that is moved. */
export declare class Sheet extends Group {
    #private;
    /** What it shows. */
    target: Target;
    /** What all of it is drawn from, updated in place. */
    geometry: SurfaceGeometry;
    /** Draws nothing, and hides what is behind the sheet: both sides do. */
    occluder: Mesh<SurfaceGeometry, MeshBasicMaterial, import("three").Object3DEventMap>;
    /** What is printed on it; null for none. The blank back stays as the camera sees it. */
    paper: Mesh<SurfaceGeometry, Material<import("three").MaterialEventMap>, import("three").Object3DEventMap> | null;
    /**
     * @param {Target} target
     * @param {SheetOptions} [options] without a print the sheet is seen as it is, and only hides what is behind it
     */
    constructor(target: Target, { map, material }?: SheetOptions);
    /**
     * An object whose pose follows a place on the sheet.
     *
     * @param {number} u from the print's left border to its right, 0 to 1
     * @param {number} v from its top to its bottom
     * @param {{ smooth?: boolean }} [options] as in {@link Anchor}
     * @returns {Anchor} a child of the sheet: `sheet.remove(anchor)` lets it go
     * @throws {RangeError} where the target has no surface
     */
    anchor(u: number, v: number, options?: {
        smooth?: boolean;
    }): Anchor;
    /**
     * Follows a frame of the video. While the target is lost, nothing of the sheet is visible.
     *
     * @param {TrackedFrame} tracked its frame must be open where a new print is lit
     * @param {number} [atMs] when, milliseconds
     */
    update(tracked: TrackedFrame, atMs?: number): void;
    /**
     * Takes the shape of a mesh, as a single image gives it.
     *
     * @param {SurfaceMesh} mesh of the same target
     * @param {number} [atMs]
     * @throws {RangeError} for the mesh of another target
     */
    show(mesh: SurfaceMesh, atMs?: number): void;
    /** Lets geometry and materials go; a print's texture stays the page's. */
    dispose(): void;
}
