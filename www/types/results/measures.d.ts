import type { SurfaceMesh } from "./surface-mesh.js";
/**
 * Measures a sheet.
 *
 * Its bend is the largest angle between two of its normals, but for the outermost 5 % at each end. Angles are measured along the direction in
 * which the normals spread most, from their mean; so a sheet that is rolled up by an angle has 0.9 times that angle, and one that is
 * folded has the fold's angle.
 *
 * @param {Pick<SurfaceMesh, "normals" | "pointAt">} mesh
 * @returns {{ distanceMm: number, bendDegrees: number }} distance of the sheet's middle from the camera
 * @throws {DeepSftError} `invalid-argument` where the target has no surface in its middle
 */
export declare function measureSheet(mesh: Pick<SurfaceMesh, "normals" | "pointAt">): {
    distanceMm: number;
    bendDegrees: number;
};
