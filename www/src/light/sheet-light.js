// The light on the sheet as light that falls on a thing that stands there: from somewhere, and from everywhere.

import { dot, unit } from "../results/vector.js";

/** Where the light comes from while the sheet does not tell: over the sheet, and this side of it. Camera frame. */
const SIDE = /** @type {const} */ ([-0.8, -0.35, -0.5]);
/** How far to that side it stands, against how high. */
const SLANT = 1.1;
/** Of the light on a sheet that faces it. */
const USUAL = { everywhere: 0.42, directed: 0.85 };
/** How much the usual light counts against all that is seen: a flat sheet shows one direction alone. */
const PRIOR_WEIGHT = 0.03;
/** Light is taken where at least so much of a vertex's surroundings is seen. */
const MIN_SEEN = 0.5;
/** The light comes from the side of the sheet that is seen, at least this steeply (the sine of its height). */
const MIN_HEIGHT = 0.35;
/** Seconds in which it follows what is seen most of the way. */
const FOLLOW_SECONDS = 0.4;

/**
 * A surface whose normal is n receives everywhere + max(0, directed · n), 1 where the image is as bright as the print.
 *
 * @typedef {{ everywhere: number, directed: [number, number, number] }} Light
 */

export class SheetLight {
  /** @type {Light | null} */
  #light = null;
  #atMs = 0;

  /** Forgets the light. */
  reset() {
    this.#light = null;
  }

  /** What was seen last. @returns {Light} */
  get light() {
    return this.#light ?? lightOf(usual(1));
  }

  /**
   * Takes over how bright a bent sheet is: the better lit a direction is, the more light comes from there. Least squares of a sum of both
   * kinds of light over the vertices, near the usual light.
   *
   * @param {Float32Array} light on each vertex
   * @param {Float32Array} normals (x, y, z) each, camera frame
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
   * @param {number} atMs
   */
  follow(light, normals, seen, atMs) {
    /** A symmetric matrix and, last, what it is to give; so its first row has the sums of all. */
    const system = Array.from({ length: 4 }, () => [0, 0, 0, 0, 0]);
    for (let i = 0; i < light.length; i++) {
      if (seen[i] < MIN_SEEN) continue;
      const row = [1, normals[3 * i], normals[3 * i + 1], normals[3 * i + 2], light[i]];
      for (let j = 0; j < 4; j++)
        for (let k = 0; k < 5; k++) system[j][k] += row[j] * row[k];
    }
    const [count, ...sums] = system[0];
    if (count < 12) return;
    const [x, y, z, brightness] = sums.map((sum) => sum / count);
    const expected = usual(brightness, [x, y, z]);
    expected.forEach((value, j) => {
      system[j][j] += PRIOR_WEIGHT * count;
      system[j][4] += PRIOR_WEIGHT * count * value;
    });
    const solution = solved(system);
    const [everywhere, ...directed] = solution;
    const isUsable = everywhere > 0.1 * expected[0] && dot(directed, [x, y, z]) > MIN_HEIGHT * Math.hypot(...directed);
    const found = isUsable ? solution : expected;
    const weight = this.#light ? 1 - Math.exp(-Math.max(0, atMs - this.#atMs) / 1000 / FOLLOW_SECONDS) : 1;
    this.#atMs = atMs;
    const before = this.#light ? [this.#light.everywhere, ...this.#light.directed] : found;
    this.#light = lightOf(before.map((value, k) => value + weight * (found[k] - value)));
  }
}

/** @param {number[]} light from everywhere, and (x, y, z) of the directed one @returns {Light} */
function lightOf([everywhere, x, y, z]) {
  return { everywhere, directed: [x, y, z] };
}

/**
 * The usual light, as {@link lightOf} takes it.
 *
 * @param {number} brightness of the sheet
 * @param {number[]} normal of the sheet
 */
function usual(brightness, normal = [0, 0, -1]) {
  const up = unit(normal);
  const along = dot(SIDE, up);
  const side = unit(SIDE.map((value, k) => value - along * up[k]));
  const towards = unit(up.map((value, k) => value + SLANT * side[k]));
  const scale = brightness / (USUAL.everywhere + USUAL.directed / Math.hypot(1, SLANT));
  return [USUAL.everywhere * scale, ...towards.map((value) => value * USUAL.directed * scale)];
}

/**
 * Solves a symmetric positive system by Gauss's and Jordan's elimination.
 *
 * @param {number[][]} system n rows of n + 1 numbers, changed
 */
function solved(system) {
  const n = system.length;
  system.forEach((pivot, i) => {
    for (const row of system) {
      if (row === pivot) continue;
      const factor = row[i] / pivot[i];
      for (let k = i; k <= n; k++) row[k] -= factor * pivot[k];
    }
  });
  return system.map((row, i) => row[n] / row[i]);
}
