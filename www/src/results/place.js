// Where on a mesh a place of the template's picture is.

import { DeepSftError } from "../error.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */

/** So far outside of a face a place still counts as on it, of the face's size: rounding at the border. */
const ROUNDING = 1e-5;

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
export function placeOn({ faces, textureCoordinates: uv }, u, v) {
  for (let face = 0; face < faces.length; face += 3) {
    const [a, b, c] = [2 * faces[face], 2 * faces[face + 1], 2 * faces[face + 2]];
    const [bu, bv, cu, cv] = [uv[b] - uv[a], uv[b + 1] - uv[a + 1], uv[c] - uv[a], uv[c + 1] - uv[a + 1]];
    const area = bu * cv - bv * cu;
    if (area === 0) continue;
    const [du, dv] = [u - uv[a], v - uv[a + 1]];
    const [atB, atC] = [(du * cv - dv * cu) / area, (bu * dv - bv * du) / area];
    if (Math.min(atB, atC, 1 - atB - atC) < -ROUNDING) continue;
    const [stepB, stepC] = [cv / area, -bv / area];
    return { face, weights: [1 - atB - atC, atB, atC], alongU: [-stepB - stepC, stepB, stepC] };
  }
  throw new DeepSftError("invalid-argument", `The target has no surface at (u, v) = (${u}, ${v}).`);
}
