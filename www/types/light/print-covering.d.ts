import type { SurfaceMesh, Target } from "../index.js";
/** Which vertices of a print nothing covers, by how the image confirms them. */
export declare class PrintCovering {
    #private;
    /** @param {Pick<Target, "texture" | "mesh">} target */
    constructor({ texture, mesh }: Pick<Target, "texture" | "mesh">);
    /** Forgets everything. */
    reset(): void;
    /**
     * Fraction of each vertex's surroundings that is seen, 0 to 1.
     *
     * @param {Pick<SurfaceMesh, "confidence">} mesh
     * @param {boolean} certain whether the mesh lies well enough for its confidence to tell what covers it
     * @returns {Float32Array}
     */
    follow({ confidence }: Pick<SurfaceMesh, "confidence">, certain: boolean): Float32Array;
}
