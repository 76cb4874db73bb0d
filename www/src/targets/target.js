// What is looked for, as pages hold it.

import { DeepSftError } from "../error.js";

/** @import { MeshTopology, TargetDescription } from "../engine/engine-worker.js" */

/**
 * Where a target comes from: a picture that was added, a template's folder, or a model, which brings a network of its own.
 *
 * @typedef {"picture" | "template" | "model"} TargetKind
 */

/** An object that is looked for. `DeepSft` makes it. */
export class Target {
  /**
   * @param {number} id
   * @param {string} name
   * @param {TargetKind} kind
   * @param {TargetDescription} description
   */
  constructor(id, name, kind, { width, height, rgba, sizeMm: [widthMm, heightMm], mesh, grade }) {
    /** Tells the targets of one `DeepSft` apart. */
    this.id = id;
    /** For people. */
    this.name = name;
    /** Where it comes from. */
    this.kind = kind;
    /** The picture on it, as it is looked for: at most 1024 pixels along the longer side if it was added as a picture. */
    this.texture = new ImageData(rgba, width, height);
    /** Width of the flat print. */
    this.widthMm = widthMm;
    /** Its height. */
    this.heightMm = heightMm;
    /**
     * What of its mesh no frame changes.
     *
     * @type {MeshTopology}
     */
    this.mesh = mesh;
    /** How well features will find it, said before it is printed; null of a model's target, which has a network. */
    this.grade = grade;
  }
}

/**
 * @param {string} message
 * @returns {DeepSftError}
 */
export function unknownTarget(message) {
  return new DeepSftError("target-unknown", message);
}
