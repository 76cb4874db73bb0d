import { Group, Mesh } from "three";
import { Anchor } from "./anchor.js";
import { PaperLight } from "./paper-light.js";
import { SurfaceGeometry } from "./surface-geometry.js";
import type { Material, Texture } from "three";
import type { Estimate, SurfaceMesh, Target, TrackedFrame } from "../index.js";
import type { AnchorOptions } from "./anchor.js";
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
    /**
     * whether what stands on the sheet is lit as the paper is, casts its shadow on it, and is hidden by what lies
     * before the paper; default false
     */
    light?: boolean;
};
/**
 * @typedef {object} SheetOptions
 * @property {Texture} [map] a new print, upright like any texture of three.js: a picture, a canvas, a video. It is lit as the real
 *   paper is, and where something lies before the paper it is left out.
 * @property {Material} [material] a material of one's own in place of that; with `vertexColors` the light of the paper is multiplied into
 *   its colours
 * @property {boolean} [light] whether what stands on the sheet is lit as the paper is, casts its shadow on it, and is hidden by what lies
 *   before the paper; default false
 */
/**
 * The surface of a target. It has its place in the camera's frame: add it to the scene, or to the camera if that is moved. A unit is a
 * millimetre; a print of unknown size is shown as if it were 200 mm wide.
 */
export declare class Sheet extends Group {
    #private;
    /** What it shows. */
    target: Target;
    /** What all of it is drawn from, updated in place. */
    geometry: SurfaceGeometry;
    /** Draws nothing, and hides what is behind the sheet: both sides do. */
    occluder: Mesh<SurfaceGeometry, Material<import("three").MaterialEventMap>, import("three").Object3DEventMap>;
    /** What is printed on it; null for none. The blank back stays as the camera sees it. */
    paper: Mesh<import("three").BufferGeometry<import("three").NormalBufferAttributes, import("three").BufferGeometryEventMap>, Material<import("three").MaterialEventMap>[] | Material<import("three").MaterialEventMap>, import("three").Object3DEventMap> | null;
    /** The light on what stands on it, where `light` asks for it. @type {PaperLight | null} */
    light: PaperLight | null;
    /**
     * @param {Target} target
     * @param {SheetOptions} [options] without a print the sheet is seen as it is, and only hides what is behind it
     */
    constructor(target: Target, { map, material, light }?: SheetOptions);
    /** The new print; null for none. Setting it takes the place of the print before, whose texture stays the page's. */
    get map(): Texture | null;
    /** @param {Texture | null} map */
    set map(map: Texture | null);
    /** What its paper is drawn with; null for nothing. Setting it disposes of the material before. @returns {Material | null} */
    get material(): Material | null;
    /** @param {Material | null} material */
    set material(material: Material | null);
    /**
     * An object whose pose follows a place on the sheet.
     *
     * @param {number} u from the print's left border to its right, 0 to 1
     * @param {number} v from its top to its bottom
     * @param {AnchorOptions} [options]
     * @returns {Anchor} a child of the sheet: `sheet.remove(anchor)` lets it go
     * @throws {DeepSftError} `invalid-argument` where the target has no surface
     * @throws {DeepSftError} `target-unusable` for a length in `mm` or `m` on a print of unknown size
     */
    anchor(u: number, v: number, options?: AnchorOptions): Anchor;
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
     * @throws {DeepSftError} `invalid-argument` for the mesh of another target
     */
    show(mesh: SurfaceMesh, atMs?: number): void;
    /**
     * Takes over what a model's network says of what covers the sheet in a frame: `onEstimate` of a session.
     *
     * @param {Estimate} estimate
     * @param {number} frame its number
     */
    answer(estimate: Estimate, frame: number): void;
    /** Lets geometry, materials and shadow go; a print's texture stays the page's. */
    dispose(): void;
}
