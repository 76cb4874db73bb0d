// Where the surface of a clip's true mesh lies, in space and in the image.

import { depthsOf } from "./silhouettes.mjs";

/** The grid of the poster's template: cells of about 10 mm. */
const [COLUMNS, ROWS] = [31, 22];

const minus = (a, b) => a.map((x, k) => x - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const times = (a, s) => a.map((x) => x * s);
const unit = (a) => times(a, 1 / Math.hypot(...a));
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

export class TrueSheet {
  #vertices;
  #camera;
  #depths;

  /**
   * @param {Float32Array} vertices (x, y, z) each, camera frame, mm
   * @param {{ width: number, height: number, fx: number, fy: number, cx: number, cy: number }} camera
   */
  constructor(vertices, camera) {
    if (vertices.length !== 3 * COLUMNS * ROWS) throw new Error(`${vertices.length / 3} vertices`);
    this.#vertices = vertices;
    this.#camera = camera;
  }

  /** @returns {[number, number, number]} camera frame, mm */
  at(u, v) {
    const [x, y] = [u * (COLUMNS - 1), v * (ROWS - 1)];
    const [i, j] = [Math.min(COLUMNS - 2, Math.max(0, Math.floor(x))), Math.min(ROWS - 2, Math.max(0, Math.floor(y)))];
    const [a, b] = [x - i, y - j];
    const [first, row] = [3 * (j * COLUMNS + i), 3 * COLUMNS];
    const coordinate = (k) => {
      const at = (offset) => this.#vertices[first + offset + k];
      return (1 - b) * ((1 - a) * at(0) + a * at(3)) + b * ((1 - a) * at(row) + a * at(row + 3));
    };
    return [coordinate(0), coordinate(1), coordinate(2)];
  }

  /** Along u, away from the print, down the print. @returns {{ origin: number[], x: number[], y: number[], z: number[] }} */
  pose(u, v) {
    const step = 0.03;
    const [alongU, alongV] = [minus(this.at(u + step, v), this.at(u - step, v)), minus(this.at(u, v + step), this.at(u, v - step))];
    // Towards a viewer who reads it: y is down in the camera's frame.
    const y = unit(cross(alongV, alongU));
    const x = unit(minus(alongU, times(y, dot(alongU, y))));
    return { origin: this.at(u, v), x, y, z: cross(x, y) };
  }

  /** Pixels and depth. @returns {[number, number, number]} */
  project([x, y, z]) {
    const { fx, fy, cx, cy } = this.#camera;
    return [(fx * x) / z + cx, (fy * y) / z + cy, z];
  }

  /** The depth of the sheet in each pixel, mm; infinite beside it. */
  depths() {
    const cell = (/** @type {number} */ i) => [i, i + COLUMNS, i + COLUMNS + 1, i, i + COLUMNS + 1, i + 1];
    const cells = Array.from({ length: (ROWS - 1) * COLUMNS }, (_, i) => i).filter((i) => i % COLUMNS < COLUMNS - 1);
    const corners = cells.flatMap(cell).map((i) => [...this.#vertices.subarray(3 * i, 3 * i + 3)]);
    return (this.#depths ??= depthsOf(corners, this.#camera));
  }
}

/** A point given in a pose's axes. */
export const inPose = ({ origin, x, y, z }, [a, b, c]) => [0, 1, 2].map((k) => origin[k] + a * x[k] + b * y[k] + c * z[k]);
