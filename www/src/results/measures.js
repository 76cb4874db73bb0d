// What of a sheet people ask for: how far away it is, and how much it bends.

import { cross, dot, unit } from "./vector.js";

/** @import { SurfaceMesh } from "./surface-mesh.js" */

/** Of the normals this fraction is left out at each end: single vertices err. */
const LEFT_OUT = 0.05;

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
export function measureSheet(mesh) {
  const { normals } = mesh;
  const mean = unit([0, 1, 2].map((k) => normals.reduce((sum, value, i) => (i % 3 === k ? sum + value : sum), 0)));
  // Two directions across the mean.
  const axis = Math.abs(mean[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0];
  const across = unit(cross(mean, axis));
  const along = cross(mean, across);
  // Each normal as a turn away from the mean: (x, y) in these directions, as long as its angle.
  const turns = Array.from({ length: normals.length / 3 }, (_, i) => {
    const normal = normals.subarray(3 * i, 3 * i + 3);
    const [x, y] = [dot(normal, across), dot(normal, along)];
    const sine = Math.hypot(x, y);
    const scale = sine > 0 ? Math.atan2(sine, dot(normal, mean)) / sine : 0;
    return [scale * x, scale * y];
  });
  const [xx, xy, yy] = turns.reduce(([a, b, c], [x, y]) => [a + x * x, b + x * y, c + y * y], [0, 0, 0]);
  const most = Math.atan2(2 * xy, xx - yy) / 2;
  const angles = Float64Array.from(turns, ([x, y]) => x * Math.cos(most) + y * Math.sin(most)).sort();
  const end = Math.floor(LEFT_OUT * angles.length);
  const bend = angles.length > 0 ? angles[angles.length - 1 - end] - angles[end] : 0;
  return { distanceMm: Math.hypot(...mesh.pointAt(0.5, 0.5)), bendDegrees: (bend * 180) / Math.PI };
}
