import { Group } from "three";
import type { Object3D } from "three";
import type { Target } from "../targets/target.js";
import type { SurfaceGeometry } from "./surface-geometry.js";
export type AnchorOptions = {
    /**
     * whether small trembling is filtered out, default true
     */
    smooth?: boolean;
    /**
     * what lengths of what stands there are counted in: `m` for glTF, `width` for the print's width. Default: the
     * target's own, which is `mm`, or `width` where its size is not known.
     */
    unit?: "mm" | "m" | "width";
    /**
     * whether what is added casts shadows and receives them
     */
    shadows?: boolean;
};
/** @import { Object3D } from "three" */
/** @import { Target } from "../targets/target.js" */
/** @import { SurfaceGeometry } from "./surface-geometry.js" */
/**
 * @typedef {object} AnchorOptions
 * @property {boolean} [smooth] whether small trembling is filtered out, default true
 * @property {"mm" | "m" | "width"} [unit] what lengths of what stands there are counted in: `m` for glTF, `width` for the print's width. Default: the
 *   target's own, which is `mm`, or `width` where its size is not known.
 * @property {boolean} [shadows] whether what is added casts shadows and receives them
 */
/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up, like most models, stands on the sheet and looks at its reader.
 */
export declare class Anchor extends Group {
    #private;
    /**
     * Use `sheet.anchor`.
     *
     * @param {Target} target
     * @param {number} u
     * @param {number} v
     * @param {AnchorOptions} [options]
     * @throws {DeepSftError} `invalid-argument` where the target has no surface
     * @throws {DeepSftError} `target-unusable` for a length in `mm` or `m` on a print of unknown size
     */
    constructor(target: Target, u: number, v: number, { smooth, unit, shadows }?: AnchorOptions);
    /** @param {Object3D[]} objects @override */
    add(...objects: Object3D[]): this;
    /**
     * Moves to another place on the surface, from the next frame on.
     *
     * @param {number} u
     * @param {number} v
     * @throws {DeepSftError} `invalid-argument` where the target has no surface; the anchor stays where it is then
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
