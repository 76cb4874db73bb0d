// What lies in front of the sheet: the network's mask, carried along on the mesh.

import { ramp } from "./ramp.js";

/** Meshes that are remembered until the network's answer to their frame is there. */
const MAX_REMEMBERED = 60;

/**
 * A vertex is seen when the mask is within so many canonical pixels of it: inside the sheet, and on its border, where the
 * mask ends anyway.
 */
const REACH = { inside: 1, border: 4 };

/** Confidence of a vertex from which on the image shows it, whatever the mask says, and below which it says nothing. */
const SHOWN = { from: 0.6, fully: 0.85 };

/** @typedef {Pick<import("../results/surface-mesh.js").SurfaceMesh, "vertices" | "textureCoordinates" | "confidence">} Mesh */
/** @typedef {{ values: () => Uint8Array, width: number, height: number }} Mask of the canonical image */
/** @typedef {{ mask: Mask, focal: number }} Masked an estimate: its mask, and the canonical image's focal length, pixels */

/** Weight of a new answer against those before: flicker of the mask at a hand's outline is smoothed. */
const NEW_WEIGHT = 0.6;

/**
 * Which vertices nothing covers, by the mask of a model's network. The mask of an older frame is looked up at the mesh of that frame, so that it moves with
 * the sheet until the next answer.
 */
export class MaskCovering {
  /** @type {Map<number, Mesh>} by frame, the oldest first */
  #meshes = new Map();
  #seen = new Float32Array();

  /** Forgets everything. */
  reset() {
    this.#meshes.clear();
    this.#seen = new Float32Array();
  }

  /**
   * Fraction of each vertex's surroundings that is seen, 0 to 1.
   *
   * @param {number} frame
   * @param {Mesh} mesh
   * @param {boolean} certain whether the mesh lies well enough for a mask to be looked up at it
   * @returns {Float32Array}
   */
  follow(frame, mesh, certain) {
    if (certain) this.#meshes.set(frame, mesh);
    const [oldest] = this.#meshes.keys();
    if (this.#meshes.size > MAX_REMEMBERED) this.#meshes.delete(oldest);
    const count = mesh.confidence.length;
    if (this.#seen.length !== count) this.#seen = new Float32Array(count).fill(1);
    return confirmed(this.#seen, mesh.confidence);
  }

  /**
   * Takes over what the network says of a frame.
   *
   * @param {number} frame
   * @param {Masked} estimate
   */
  answer(frame, estimate) {
    const mesh = this.#meshes.get(frame);
    if (!mesh || this.#seen.length !== mesh.confidence.length) return;
    const seen = seenFractions(mesh, estimate);
    this.#seen = this.#seen.map((before, i) => before + NEW_WEIGHT * (seen[i] - before));
  }
}

/**
 * What is seen by the mask or by the print itself.
 *
 * @param {Float32Array} seen by the mask, 0 to 1
 * @param {Float32Array} confidence of the vertices
 * @returns {Float32Array}
 */
export function confirmed(seen, confidence) {
  return seen.map((fraction, i) => Math.max(fraction, ramp(confidence[i], SHOWN)));
}

/**
 * Which vertices the mask of their own frame sees.
 *
 * @param {Pick<Mesh, "vertices" | "textureCoordinates">} mesh
 * @param {Masked} estimate
 * @returns {Float32Array} 0 or 1 each
 */
export function seenFractions({ vertices, textureCoordinates }, { mask, focal }) {
  const { width, height } = mask;
  const values = mask.values();
  return Float32Array.from({ length: vertices.length / 3 }, (_, i) => {
    const [x, y, z] = vertices.subarray(3 * i, 3 * i + 3);
    const column = Math.floor((x / z) * focal + width / 2);
    const row = Math.floor((y / z) * focal + height / 2);
    // Where the image does not reach nothing is known to cover it.
    if (column < 0 || row < 0 || column >= width || row >= height) return 1;
    const onBorder = textureCoordinates.subarray(2 * i, 2 * i + 2).some((c) => c <= 0 || c >= 1);
    const reach = onBorder ? REACH.border : REACH.inside;
    const [from, to] = [Math.max(0, column - reach), Math.min(width - 1, column + reach)];
    for (let j = Math.max(0, row - reach); j <= Math.min(height - 1, row + reach); j++)
      if (values.subarray(j * width + from, j * width + to + 1).includes(1)) return 1;
    return 0;
  });
}
