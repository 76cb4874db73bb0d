// The plane-to-image map of a flat sheet, from its registration.

/**
 * A homography as nine numbers, row-major, and how well it fits: the RMS distance in image units of the points kept.
 *
 * @typedef {{ matrix: number[], rms: number }} Homography
 */

/** Rounds in which points further than this many RMS are left out: registration errs most at borders and occluders. */
const TRIM_ROUNDS = 2;
const TRIM_RMS = 2.5;

/**
 * The similarity that centres points and makes their mean distance from the centre 1 (Hartley's normalisation).
 *
 * @param {readonly [number, number][]} points
 */
function normalisation(points) {
  const n = points.length;
  const cx = points.reduce((sum, [x]) => sum + x, 0) / n;
  const cy = points.reduce((sum, [, y]) => sum + y, 0) / n;
  const scale = n / points.reduce((sum, [x, y]) => sum + Math.hypot(x - cx, y - cy), 0);
  return { cx, cy, scale };
}

/**
 * Solves A x = b for a symmetric positive definite A (row-major, n x n) by Cholesky; null when it is singular.
 *
 * @param {Float64Array} a overwritten
 * @param {Float64Array} b overwritten with x
 * @returns {Float64Array | null}
 */
function solveSymmetric(a, b) {
  const n = b.length;
  for (let j = 0; j < n; j++) {
    for (let k = 0; k < j; k++) a[j * n + j] -= a[j * n + k] ** 2;
    if (!(a[j * n + j] > 1e-12)) return null;
    a[j * n + j] = Math.sqrt(a[j * n + j]);
    for (let i = j + 1; i < n; i++) {
      for (let k = 0; k < j; k++) a[i * n + j] -= a[i * n + k] * a[j * n + k];
      a[i * n + j] /= a[j * n + j];
    }
  }
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < i; k++) b[i] -= a[i * n + k] * b[k];
    b[i] /= a[i * n + i];
  }
  for (let i = n - 1; i >= 0; i--) {
    for (let k = i + 1; k < n; k++) b[i] -= a[k * n + i] * b[k];
    b[i] /= a[i * n + i];
  }
  return b;
}

/**
 * Least-squares homography by the direct linear transformation with the last entry 1, on normalised points.
 *
 * @param {readonly [number, number][]} plane
 * @param {readonly [number, number][]} image
 * @returns {number[] | null} null when the points do not determine it
 */
function directLinear(plane, image) {
  const [from, to] = [normalisation(plane), normalisation(image)];
  const [ata, atb] = [new Float64Array(64), new Float64Array(8)];
  const addRow = (/** @type {number[]} */ row, /** @type {number} */ value) => {
    for (let i = 0; i < 8; i++) {
      atb[i] += row[i] * value;
      for (let j = 0; j < 8; j++) ata[i * 8 + j] += row[i] * row[j];
    }
  };
  for (let k = 0; k < plane.length; k++) {
    const [x, y] = [(plane[k][0] - from.cx) * from.scale, (plane[k][1] - from.cy) * from.scale];
    const [u, v] = [(image[k][0] - to.cx) * to.scale, (image[k][1] - to.cy) * to.scale];
    addRow([x, y, 1, 0, 0, 0, -u * x, -u * y], u);
    addRow([0, 0, 0, x, y, 1, -v * x, -v * y], v);
  }
  const h = solveSymmetric(ata, atb);
  if (h === null) return null;
  // Undo both normalisations: H = T_image^-1 h T_plane.
  const rows = [
    [h[0] / to.scale + to.cx * h[6], h[1] / to.scale + to.cx * h[7], h[2] / to.scale + to.cx],
    [h[3] / to.scale + to.cy * h[6], h[4] / to.scale + to.cy * h[7], h[5] / to.scale + to.cy],
    [h[6], h[7], 1],
  ];
  return rows.flatMap(([a, b, c]) => [a * from.scale, b * from.scale, c - from.scale * (a * from.cx + b * from.cy)]);
}

/**
 * @param {readonly number[]} h
 * @param {readonly [number, number]} point
 * @returns {[number, number]}
 */
export function applyHomography(h, [x, y]) {
  const w = h[6] * x + h[7] * y + h[8];
  return [(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w];
}

/**
 * Robust least-squares homography from plane points to image points.
 *
 * @param {readonly [number, number][]} plane
 * @param {readonly [number, number][]} image one for each plane point
 * @returns {Homography | null} null when fewer than four points are left or they do not determine it
 */
export function fitHomography(plane, image) {
  let kept = plane.map((_, i) => i);
  for (let round = 0; ; round++) {
    if (kept.length < 4) return null;
    const matrix = directLinear(
      kept.map((i) => plane[i]),
      kept.map((i) => image[i]),
    );
    if (matrix === null) return null;
    const distance = (/** @type {number} */ i) => {
      const [x, y] = applyHomography(matrix, plane[i]);
      return Math.hypot(x - image[i][0], y - image[i][1]);
    };
    const rms = Math.sqrt(kept.reduce((sum, i) => sum + distance(i) ** 2, 0) / kept.length);
    if (round === TRIM_ROUNDS) return { matrix, rms };
    kept = kept.filter((i) => distance(i) <= TRIM_RMS * rms + Number.EPSILON);
  }
}
