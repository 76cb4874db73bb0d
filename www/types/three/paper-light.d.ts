import { DirectionalLight, Group, HemisphereLight } from "three";
import type { Object3D } from "three";
/**
 * Light from somewhere, with shadows, and from everywhere, as bright as the sheet shows it: white stands out from white paper by its
 * shape alone. The child of a sheet.
 */
export declare class PaperLight extends Group {
    #private;
    /** From somewhere. */
    directed: DirectionalLight;
    /** From everywhere. */
    everywhere: HemisphereLight;
    /** Fraction of the light on the sheet that is left in a shadow. */
    shade: number;
    constructor();
    /** Forgets the light: the sheet was lost. */
    reset(): void;
    /**
     * Takes over how bright the sheet is; the sheet calls it.
     *
     * @param {Float32Array} light on each vertex, as `VertexLight` tells it
     * @param {Float32Array} normals of the vertices, in the camera's frame of `deepsft`
     * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
     * @param {number} atMs
     */
    follow(light: Float32Array, normals: Float32Array, seen: Float32Array, atMs: number): void;
    /**
     * Lets the light fall on what stands on the sheet, so that its shadow is as sharp as it can be; the sheet calls it.
     *
     * @param {Object3D[]} objects
     */
    shineOn(objects: Object3D[]): undefined;
}
