// A place on a tracked surface that things can stand on.

import { Group } from "three";
import { SurfacePose } from "../results/surface-pose.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */
/** @import { SurfaceGeometry } from "./surface-geometry.js" */

/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up, like most models, stands on the sheet and looks at its reader. Units are millimetres.
 */
export class Anchor extends Group {
  #pose;

  /**
   * Use `sheet.anchor`.
   *
   * @param {MeshTopology} topology
   * @param {number} u
   * @param {number} v
   * @param {{ smooth?: boolean }} [options] whether small trembling is filtered out, default true
   * @throws {RangeError} where the target has no surface
   */
  constructor(topology, u, v, options) {
    super();
    this.#pose = new SurfacePose(topology, u, v, options);
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
    this.#pose.place(u, v);
  }

  /**
   * Takes the pose of its place; the sheet calls it.
   *
   * @param {SurfaceGeometry} geometry of the topology
   * @param {number} atMs
   */
  follow(geometry, atMs) {
    const arrayOf = (/** @type {string} */ name) => /** @type {Float32Array} */ (geometry.getAttribute(name).array);
    this.#pose.follow({ vertices: arrayOf("position"), normals: arrayOf("normal") }, atMs);
    this.position.fromArray(this.#pose.position);
    this.quaternion.fromArray(this.#pose.quaternion);
    this.visible = true;
  }

  /** Is invisible until the next pose, which it takes at once; the sheet calls it. */
  lose() {
    this.visible = false;
    this.#pose.lose();
  }
}
