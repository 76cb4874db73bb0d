// A place on a tracked surface that things can stand on.

import { Group, Matrix4, Quaternion, Vector3 } from "three";
import { placeOn } from "../results/place.js";
import { PoseFilter } from "./pose-filter.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { SurfaceGeometry } from "./surface-geometry.js" */

// Reused by each pose.
const [corner, tangent, normal, across] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
const axes = new Matrix4();

/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side, and z runs down the print. So
 * what has y up, like most models, stands on the sheet and looks at its reader. Units are millimetres.
 */
export class Anchor extends Group {
  #topology;
  #filter;
  #position = new Vector3();
  #quaternion = new Quaternion();
  #on;

  /**
   * Use `sheet.anchor`.
   *
   * @param {MeshTopology} topology
   * @param {number} u
   * @param {number} v
   * @param {{ smooth?: boolean }} [options] whether small trembling is filtered out, default true
   * @throws {RangeError} where the target has no surface
   */
  constructor(topology, u, v, { smooth = true } = {}) {
    super();
    this.#topology = topology;
    this.#filter = smooth ? new PoseFilter() : null;
    this.#on = placeOn(topology, u, v);
    this.visible = false;
  }

  /**
   * Moves to another place on the surface, from the next frame on.
   *
   * @param {number} u
   * @param {number} v
   * @throws {RangeError} where the target has no surface; the anchor stays where it is then
   */
  place(u, v) {
    this.#on = placeOn(this.#topology, u, v);
    this.#filter?.reset();
  }

  /**
   * Takes the pose of its place; the sheet calls it.
   *
   * @param {SurfaceGeometry} geometry of the topology
   * @param {number} atMs
   */
  follow(geometry, atMs) {
    const { face, weights, alongU } = this.#on;
    const [positions, normals] = [geometry.getAttribute("position"), geometry.getAttribute("normal")];
    this.#position.set(0, 0, 0);
    normal.set(0, 0, 0);
    tangent.set(0, 0, 0);
    for (let k = 0; k < 3; k++) {
      const vertex = this.#topology.faces[face + k];
      corner.fromBufferAttribute(positions, vertex);
      this.#position.addScaledVector(corner, weights[k]);
      tangent.addScaledVector(corner, alongU[k]);
      normal.addScaledVector(corner.fromBufferAttribute(normals, vertex), weights[k]);
    }
    normal.normalize();
    tangent.addScaledVector(normal, -tangent.dot(normal)).normalize();
    axes.makeBasis(tangent, normal, across.crossVectors(tangent, normal));
    this.#quaternion.setFromRotationMatrix(axes);
    this.#filter?.apply(this.#position, this.#quaternion, atMs);
    this.position.copy(this.#position);
    this.quaternion.copy(this.#quaternion);
    this.visible = true;
  }

  /** Is invisible until the next pose, which it takes at once; the sheet calls it. */
  lose() {
    this.visible = false;
    this.#filter?.reset();
  }
}
