export type Light = {
    everywhere: number;
    directed: [number, number, number];
};
/**
 * A surface whose normal is n receives everywhere + max(0, directed · n), 1 where the image is as bright as the print.
 *
 * @typedef {{ everywhere: number, directed: [number, number, number] }} Light
 */
export declare class SheetLight {
    #private;
    /** Forgets the light. */
    reset(): void;
    /** What was seen last. @returns {Light} */
    get light(): Light;
    /**
     * Takes over how bright a bent sheet is: the better lit a direction is, the more light comes from there. Least squares of a sum of both
     * kinds of light over the vertices, near the usual light.
     *
     * @param {Float32Array} light on each vertex
     * @param {Float32Array} normals (x, y, z) each, camera frame
     * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
     * @param {number} atMs
     */
    follow(light: Float32Array, normals: Float32Array, seen: Float32Array, atMs: number): void;
}
