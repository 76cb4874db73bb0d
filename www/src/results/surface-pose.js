// The pose of a place on a tracked surface, for things that stand there.

import { placeOn } from "./place.js";
import { PoseFilter } from "./pose-filter.js";
import { cross, dot, unit } from "./vector.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { Position, Quaternion } from "./pose-filter.js" */

/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up stands on the sheet and looks at its reader. In the frame of the vertices it is given; any right-handed one does.
 */
export class SurfacePose {
  #topology;
  #filter;
  #on;
  /** mm. @type {Position} */
  position = [0, 0, 0];
  /** (x, y, z, w): from the place's axes to the frame of the vertices. @type {Quaternion} */
  quaternion = [0, 0, 0, 1];

  /**
   * @param {MeshTopology} topology `target.mesh`
   * @param {number} u from the print's left border to its right, 0 to 1
   * @param {number} v from its top to its bottom
   * @param {{ smooth?: boolean }} [options] whether small trembling is filtered out, default true
   * @throws {DeepSftError} `invalid-argument` where the target has no surface
   */
  constructor(topology, u, v, { smooth = true } = {}) {
    this.#topology = topology;
    this.#filter = smooth ? new PoseFilter(topology.perMm) : null;
    this.#on = placeOn(topology, u, v);
  }

  /**
   * Moves to another place on the surface, from the next mesh on.
   *
   * @param {number} u
   * @param {number} v
   * @throws {DeepSftError} `invalid-argument` where the target has no surface; it stays where it is then
   */
  place(u, v) {
    this.#on = placeOn(this.#topology, u, v);
    this.#filter?.reset();
  }

  /**
   * Takes the pose of its place.
   *
   * @param {{ vertices: Float32Array, normals: Float32Array }} mesh (x, y, z) each: a `SurfaceMesh`
   * @param {number} atMs when, milliseconds
   */
  follow({ vertices, normals }, atMs) {
    const { face, weights, alongU } = this.#on;
    const [tangent, normal] = [[0, 0, 0], [0, 0, 0]];
    this.position.fill(0);
    for (let corner = 0; corner < 3; corner++) {
      const at = 3 * this.#topology.faces[face + corner];
      for (let k = 0; k < 3; k++) {
        this.position[k] += weights[corner] * vertices[at + k];
        tangent[k] += alongU[corner] * vertices[at + k];
        normal[k] += weights[corner] * normals[at + k];
      }
    }
    const y = unit(normal);
    const along = dot(tangent, y);
    this.quaternion = quaternionOf(unit(tangent.map((value, k) => value - along * y[k])), y);
    this.#filter?.apply(this.position, this.quaternion, atMs);
  }

  /** Takes the next pose at once: the surface was lost. */
  lose() {
    this.#filter?.reset();
  }
}

/**
 * The orientation with these axes x and y, of length 1 and at a right angle.
 *
 * @param {number[]} x
 * @param {number[]} y
 * @returns {Quaternion}
 */
function quaternionOf(x, y) {
  const z = cross(x, y);
  // Each times four times w, x, y or z: the largest of them divides best.
  const squares = [1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2]];
  const largest = squares.indexOf(Math.max(...squares));
  const [a, b, c] = [y[2] - z[1], z[0] - x[2], x[1] - y[0]];
  const [d, e, f] = [x[1] + y[0], z[0] + x[2], y[2] + z[1]];
  const [qw, qx, qy, qz] = [
    [squares[0], a, b, c],
    [a, squares[1], d, e],
    [b, d, squares[2], f],
    [c, e, f, squares[3]],
  ][largest].map((value) => value / (2 * Math.sqrt(squares[largest])));
  return [qx, qy, qz, qw];
}
