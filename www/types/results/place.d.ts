import type { MeshTopology } from "../engine/engine-worker.js";
/**
 * The face that a place lies on.
 *
 * @param {MeshTopology} topology
 * @param {number} u
 * @param {number} v
 * @returns {{ face: number, weights: [number, number, number], alongU: [number, number, number] }} where its corners begin, how they
 *   add up to the place, and to a step along u
 * @throws {DeepSftError} `invalid-argument`
 */
export declare function placeOn({ faces, textureCoordinates: uv }: MeshTopology, u: number, v: number): {
    face: number;
    weights: [number, number, number];
    alongU: [number, number, number];
};
