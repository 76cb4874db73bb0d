// What lies in front of a print that no network looks at: where its detail should be seen, and is not.

import { ramp } from "./ramp.js";
import { luminanceOf } from "./template-light.js";

/** @import { SurfaceMesh, Target } from "../index.js" */

/** Standard deviation of the print's luminance around a vertex, 0 to 255, from which on the image must confirm it, and below which it cannot. */
const DETAIL = { from: 8, fully: 20 };
/** Confidence of a vertex with detail below which something covers it, and from which on nothing does. */
const SHOWN = { from: 0.25, fully: 0.55 };
/** Weight of a new frame against those before: flicker at a hand's outline is smoothed. */
const NEW_WEIGHT = 0.5;
/** Weight with which a frame that does not tell what covers the print speaks for nothing. */
const DOUBT_WEIGHT = 0.03;
/** Weight with which a vertex without detail around it counts as seen. */
const BLANK_WEIGHT = 0.05;

/** Which vertices of a print nothing covers, by how the image confirms them. */
export class PrintCovering {
  #detail;
  #neighbours;
  #seen = new Float32Array();

  /** @param {Pick<Target, "texture" | "mesh">} target */
  constructor({ texture, mesh }) {
    const { faces, textureCoordinates } = mesh;
    const around = Array.from({ length: textureCoordinates.length / 2 }, () => /** @type {Set<number>} */ (new Set()));
    faces.forEach((vertex, corner) => {
      const start = corner - (corner % 3);
      for (const other of faces.subarray(start, start + 3)) if (other !== vertex) around[vertex].add(other);
    });
    this.#neighbours = around.map((set) => [...set]);
    this.#detail = detailOf(texture, textureCoordinates, this.#neighbours);
  }

  /** Forgets everything. */
  reset() {
    this.#seen = new Float32Array();
  }

  /**
   * Fraction of each vertex's surroundings that is seen, 0 to 1.
   *
   * @param {Pick<SurfaceMesh, "confidence">} mesh
   * @param {boolean} certain whether the mesh lies well enough for its confidence to tell what covers it
   * @returns {Float32Array}
   */
  follow({ confidence }, certain) {
    const isFirst = this.#seen.length !== confidence.length;
    if (isFirst) this.#seen = new Float32Array(confidence.length).fill(1);
    const [detail, before] = [this.#detail, this.#seen];
    // What covered it may be gone by now.
    if (!certain) return (this.#seen = before.map((old) => old + DOUBT_WEIGHT * (1 - old)));
    const shown = confidence.map((c) => ramp(c, SHOWN));
    this.#seen = before.map((old, i) => {
      let [sum, weights] = [BLANK_WEIGHT + 2 * detail[i] * shown[i], BLANK_WEIGHT + 2 * detail[i]];
      for (const j of this.#neighbours[i]) {
        sum += detail[j] * shown[j];
        weights += detail[j];
      }
      return old + (isFirst ? 1 : NEW_WEIGHT) * (sum / weights - old);
    });
    return this.#seen;
  }
}

/**
 * How far the image can confirm each vertex, 0 to 1, by the print between it and its neighbours.
 *
 * @param {{ data: Uint8ClampedArray, width: number, height: number }} texture RGBA
 * @param {Float32Array} textureCoordinates
 * @param {number[][]} neighbours
 */
function detailOf({ data, width, height }, textureCoordinates, neighbours) {
  const pixel = (/** @type {number} */ at, /** @type {number} */ side) => Math.min(side - 1, Math.max(0, Math.floor(at * side)));
  const luminance = (/** @type {number} */ u, /** @type {number} */ v) => {
    const i = 4 * (pixel(v, height) * width + pixel(u, width));
    return luminanceOf(data[i], data[i + 1], data[i + 2]);
  };
  return Float32Array.from(neighbours, (around, i) => {
    const [u, v] = textureCoordinates.subarray(2 * i, 2 * i + 2);
    const values = around.flatMap((j) =>
      [0, 0.25, 0.5, 0.75].map((t) => luminance(u + t * (textureCoordinates[2 * j] - u), v + t * (textureCoordinates[2 * j + 1] - v))),
    );
    const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
    const variance = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / values.length;
    return ramp(Math.sqrt(variance), DETAIL);
  });
}
