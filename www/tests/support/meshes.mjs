// Meshes against each other.

/**
 * How far two meshes with the same vertices are apart: mm in space, and pixels in the canonical image over the vertices
 * that lie in it.
 *
 * @param {ArrayLike<number>} one (x, y, z) each, camera frame, mm
 * @param {ArrayLike<number>} other
 * @param {{ width: number, height: number }} [canonical] size of the canonical image
 * @returns {{ rmsMm: number, maxMm: number, medianPx: number }}
 */
export function meshDistance(one, other, { width, height } = { width: 480, height: 270 }) {
  if (one.length !== other.length) throw new Error(`${one.length / 3} and ${other.length / 3} vertices`);
  const [distances, pixels] = [[], []];
  for (let i = 0; i < one.length; i += 3) {
    distances.push(Math.hypot(one[i] - other[i], one[i + 1] - other[i + 1], one[i + 2] - other[i + 2]));
    // By the canonical camera, f = 380.
    const seen = ([x, y, z]) => [(380 * x) / z + width / 2, (380 * y) / z + height / 2];
    const [p, q] = [one, other].map((mesh) => seen([mesh[i], mesh[i + 1], mesh[i + 2]]));
    if (q[0] >= 0 && q[1] >= 0 && q[0] < width && q[1] < height) pixels.push(Math.hypot(p[0] - q[0], p[1] - q[1]));
  }
  pixels.sort((a, b) => a - b);
  return {
    rmsMm: Math.sqrt(distances.reduce((sum, d) => sum + d * d, 0) / distances.length),
    maxMm: Math.max(...distances),
    medianPx: pixels[pixels.length >> 1] ?? 0,
  };
}
