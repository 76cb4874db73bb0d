// The light on a mesh by its vertices.

import { verticesInImage } from "../camera/canonical.js";
import { gentleRamp } from "./ramp.js";
import { LIGHT_FLOOR, LINEAR_OF_SRGB, MAX_LIGHT, luminanceOf } from "./template-light.js";

/** @import { MeshTopology, SourcedCamera, SurfaceMesh } from "../index.js" */
/** @import { TemplateLight } from "./template-light.js" */

/** What is printed on a face is the mean of its cells, of so many along each edge. */
const PRINTED_AT = 4;
/** Fraction of a face that is seen, from which on it counts. */
const COUNTS = { from: 0.4, fully: 0.9 };

/** What is seen divided by what is printed, both the mean of the faces around a vertex and of those around its neighbours. */
export class VertexLight {
  #faces;
  /** Luminance of what is printed on each face. */
  #printed;

  /**
   * @param {MeshTopology} mesh
   * @param {TemplateLight} template
   */
  constructor({ faces, textureCoordinates }, template) {
    this.#faces = faces;
    this.#printed = Float32Array.from({ length: faces.length / 3 }, (_, face) => {
      const corner = (/** @type {number} */ k, /** @type {number} */ axis) => textureCoordinates[2 * faces[3 * face + k] + axis];
      let [sum, count] = [0, 0];
      for (let i = 0; i < PRINTED_AT; i++) {
        for (let j = 0; i + j < PRINTED_AT; j++, count++) {
          const [a, b] = [(i + 1 / 3) / PRINTED_AT, (j + 1 / 3) / PRINTED_AT];
          const at = (/** @type {number} */ axis) => a * corner(0, axis) + b * corner(1, axis) + (1 - a - b) * corner(2, axis);
          sum += template.luminanceAt(at(0), at(1));
        }
      }
      return sum / count;
    });
  }

  /**
   * @param {SurfaceMesh["vertices"]} vertices
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
   * @param {SourcedCamera} camera
   * @param {{ data: Uint8ClampedArray, width: number, height: number }} frame RGBA, small: each pixel the mean of those it stands for
   * @returns {Float32Array} linear light on each vertex, 1 where the image is as bright as the print
   */
  of(vertices, seen, camera, frame) {
    const { data } = frame;
    const luminance = new Float32Array(data.length / 4);
    for (let i = 0; i < luminance.length; i++)
      luminance[i] = luminanceOf(LINEAR_OF_SRGB[data[4 * i]], LINEAR_OF_SRGB[data[4 * i + 1]], LINEAR_OF_SRGB[data[4 * i + 2]]);
    const points = verticesInImage(vertices, camera, frame.width / camera.width);
    // Of each vertex: luminance seen and printed, both times their weight, and the weight.
    const sums = new Float32Array(3 * seen.length);
    const faces = this.#faces;
    for (let i = 0; i < faces.length; i += 3) {
      const [a, b, c] = [faces[i], faces[i + 1], faces[i + 2]];
      const [ax, bx, cx] = [points[2 * a], points[2 * b], points[2 * c]];
      const [ay, by, cy] = [points[2 * a + 1], points[2 * b + 1], points[2 * c + 1]];
      // Twice the area in the image, where y points down: negative where the back is seen.
      const area = (cx - ax) * (by - ay) - (bx - ax) * (cy - ay);
      const weight = area * gentleRamp((seen[a] + seen[b] + seen[c]) / 3, COUNTS);
      if (!(weight > 0)) continue;
      // The mean of three places, each half way from the middle to a corner.
      const [x, y] = [ax + bx + cx, ay + by + cy];
      const nearA = sampled(luminance, frame, (x + 3 * ax) / 6, (y + 3 * ay) / 6);
      const nearB = sampled(luminance, frame, (x + 3 * bx) / 6, (y + 3 * by) / 6);
      const nearC = sampled(luminance, frame, (x + 3 * cx) / 6, (y + 3 * cy) / 6);
      for (let k = 0; k < 3; k++) {
        const at = 3 * faces[i + k];
        sums[at] += (weight * (nearA + nearB + nearC)) / 3;
        sums[at + 1] += weight * this.#printed[i / 3];
        sums[at + 2] += weight;
      }
    }
    const spread = this.#spread(sums);
    return seen.map((_, i) => {
      const weight = spread[3 * i + 2];
      if (weight < 1e-6) return 1;
      return Math.min(MAX_LIGHT, (spread[3 * i] / weight + LIGHT_FLOOR) / (spread[3 * i + 1] / weight + LIGHT_FLOOR));
    });
  }

  /** Each vertex's sums and those of its neighbours. @param {Float32Array} sums */
  #spread(sums) {
    const spread = new Float32Array(sums.length);
    const faces = this.#faces;
    for (let i = 0; i < faces.length; i += 3) {
      const [a, b, c] = [3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2]];
      for (let k = 0; k < 3; k++) {
        const sum = sums[a + k] + sums[b + k] + sums[c + k];
        spread[a + k] += sum;
        spread[b + k] += sum;
        spread[c + k] += sum;
      }
    }
    return spread;
  }
}

/**
 * @param {Float32Array} values
 * @param {{ width: number, height: number }} size
 * @param {number} x pixels; centres of pixels lie at halves
 * @param {number} y
 */
function sampled(values, { width, height }, x, y) {
  const [fx, fy] = [Math.min(width - 1, Math.max(0, x - 0.5)), Math.min(height - 1, Math.max(0, y - 0.5))];
  const [left, top] = [Math.min(width - 2, Math.floor(fx)), Math.min(height - 2, Math.floor(fy))];
  const [u, v] = [fx - left, fy - top];
  const at = top * width + left;
  return (1 - v) * ((1 - u) * values[at] + u * values[at + 1]) + v * ((1 - u) * values[at + width] + u * values[at + width + 1]);
}
