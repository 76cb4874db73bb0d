// What is looked for, as pages hold it.

import { DeepSftError } from "../error.js";

/** @import { MeshTopology, TargetDescription } from "../engine/engine-worker.js" */

/**
 * Where a target comes from: a picture that was added, a template's folder, or a model, which brings a network of its own.
 *
 * @typedef {"picture" | "template" | "model"} TargetKind
 */

/** Number of the model's target. */
export const MODEL_TARGET = 0;

/** An object that is looked for. `DeepSft` makes it. */
export class Target {
  /**
   * @param {number} id
   * @param {string} name
   * @param {TargetKind} kind
   * @param {TargetDescription} description
   * @param {boolean} [hasSize] whether the size is that of the print, and not one that was made up
   */
  constructor(id, name, kind, { width, height, rgba, sizeMm: [widthMm, heightMm], mesh, grade }, hasSize = true) {
    /** Tells the targets of one `DeepSft` apart. */
    this.id = id;
    /** For people. */
    this.name = name;
    /** Where it comes from. */
    this.kind = kind;
    /** The picture on it, as it is looked for: at most 1024 pixels along the longer side if it was added as a picture. */
    this.texture = new ImageData(rgba, width, height);
    /**
     * What lengths of it are counted in, depths and distances too: millimetres, or, of a print whose size is not known, its width.
     *
     * @type {"mm" | "width"}
     */
    this.unit = hasSize ? "mm" : "width";
    /** Width of the flat print; NaN where it is not known. */
    this.widthMm = hasSize ? widthMm : Number.NaN;
    /** Its height; likewise. */
    this.heightMm = hasSize ? heightMm : Number.NaN;
    /**
     * What of its mesh no frame changes.
     *
     * @type {MeshTopology}
     */
    this.mesh = hasSize ? mesh : { ...mesh, perMm: 1 / widthMm };
    /**
     * The targets that its picture resembled when it was added, the most alike first, and the share of corners that they have in common, 0 to 1.
     * In one place of an image only the better one counts as found.
     *
     * @type {{ target: Target, share: number }[]}
     */
    this.alike = [];
    /** How well features will find it, said before it is printed; null of a model's target, which has a network. */
    this.grade = grade;
  }
}

/** @param {string} message */
export function unknownTarget(message) {
  return new DeepSftError("target-unknown", message);
}
