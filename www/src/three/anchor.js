// A place on a tracked surface that things can stand on.

import { Group } from "three";
import { DeepSftError } from "../error.js";
import { SurfacePose } from "../results/surface-pose.js";

/** @import { Object3D } from "three" */
/** @import { Target } from "../targets/target.js" */
/** @import { SurfaceGeometry } from "./surface-geometry.js" */

/**
 * @typedef {object} AnchorOptions
 * @property {boolean} [smooth] whether small trembling is filtered out, default true
 * @property {"mm" | "m" | "width"} [unit] what lengths of what stands there are counted in: `m` for glTF, `width` for the print's width. Default: the
 *   target's own, which is `mm`, or `width` where its size is not known.
 * @property {boolean} [shadows] whether what is added casts shadows and receives them
 */

/**
 * Follows a place (u, v) of a surface: x runs along u, y is the surface's normal, away from the printed side's back, and z runs down the
 * print. So what has y up, like most models, stands on the sheet and looks at its reader.
 */
export class Anchor extends Group {
  #pose;
  #shadows;

  /**
   * Use `sheet.anchor`.
   *
   * @param {Target} target
   * @param {number} u
   * @param {number} v
   * @param {AnchorOptions} [options]
   * @throws {DeepSftError} `invalid-argument` where the target has no surface
   * @throws {DeepSftError} `target-unusable` for a length in `mm` or `m` on a print of unknown size
   */
  constructor(target, u, v, { smooth, unit = target.unit, shadows = false } = {}) {
    super();
    this.#pose = new SurfacePose(target.mesh, u, v, { smooth });
    this.#shadows = shadows;
    const hasSize = target.unit !== "width";
    if (unit !== "width" && !hasSize)
      throw new DeepSftError("target-unusable", `The size of ${target.name} is not known, so nothing on it can be so many ${unit} large: give its widthMm.`);
    const width = hasSize ? target.widthMm : 1;
    this.scale.setScalar(unit === "width" ? width : unit === "m" ? 1000 : 1);
    this.visible = false;
  }

  /** @param {Object3D[]} objects @override */
  add(...objects) {
    const shadows = { castShadow: true, receiveShadow: true };
    if (this.#shadows) for (const object of objects) object.traverse((part) => "isMesh" in part && Object.assign(part, shadows));
    return super.add(...objects);
  }

  /**
   * Moves to another place on the surface, from the next frame on.
   *
   * @param {number} u
   * @param {number} v
   * @throws {DeepSftError} `invalid-argument` where the target has no surface; the anchor stays where it is then
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
