export type Mesh = Pick<import("../results/surface-mesh.js").SurfaceMesh, "vertices" | "textureCoordinates" | "confidence">;
export type Mask = {
    values: () => Uint8Array;
    width: number;
    height: number;
};
export type Masked = {
    mask: Mask;
    focal: number;
};
/**
 * Which vertices nothing covers, by the mask of a model's network. The mask of an older frame is looked up at the mesh of that frame, so that it moves with
 * the sheet until the next answer.
 */
export declare class MaskCovering {
    #private;
    /** Forgets everything. */
    reset(): void;
    /**
     * Fraction of each vertex's surroundings that is seen, 0 to 1.
     *
     * @param {number} frame
     * @param {Mesh} mesh
     * @param {boolean} certain whether the mesh lies well enough for a mask to be looked up at it
     * @returns {Float32Array}
     */
    follow(frame: number, mesh: Mesh, certain: boolean): Float32Array;
    /**
     * Takes over what the network says of a frame.
     *
     * @param {number} frame
     * @param {Masked} estimate
     */
    answer(frame: number, estimate: Masked): void;
}
/**
 * What is seen by the mask or by the print itself.
 *
 * @param {Float32Array} seen by the mask, 0 to 1
 * @param {Float32Array} confidence of the vertices
 * @returns {Float32Array}
 */
export declare function confirmed(seen: Float32Array, confidence: Float32Array): Float32Array;
/**
 * Which vertices the mask of their own frame sees.
 *
 * @param {Pick<Mesh, "vertices" | "textureCoordinates">} mesh
 * @param {Masked} estimate
 * @returns {Float32Array} 0 or 1 each
 */
export declare function seenFractions({ vertices, textureCoordinates }: Pick<Mesh, "vertices" | "textureCoordinates">, { mask, focal }: Masked): Float32Array;
