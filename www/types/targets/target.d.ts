import { DeepSftError } from "../error.js";
import type { MeshTopology, TargetDescription } from "../engine/engine-worker.js";
export type TargetKind = "picture" | "template" | "model";
/** @import { MeshTopology, TargetDescription } from "../engine/engine-worker.js" */
/**
 * Where a target comes from: a picture that was added, a template's folder, or a model, which brings a network of its own.
 *
 * @typedef {"picture" | "template" | "model"} TargetKind
 */
/** An object that is looked for. `DeepSft` makes it. */
export declare class Target {
    /** Tells the targets of one `DeepSft` apart. */
    id: number;
    /** For people. */
    name: string;
    /** Where it comes from. */
    kind: TargetKind;
    /** The picture on it, as it is looked for: at most 1024 pixels along the longer side if it was added as a picture. */
    texture: ImageData;
    /** Width of the flat print. */
    widthMm: number;
    /** Its height. */
    heightMm: number;
    /**
     * What of its mesh no frame changes.
     *
     * @type {MeshTopology}
     */
    mesh: MeshTopology;
    /** How well features will find it, said before it is printed; null of a model's target, which has a network. */
    grade: import("../engine/engine-worker.js").PictureGrade | null;
    /**
     * @param {number} id
     * @param {string} name
     * @param {TargetKind} kind
     * @param {TargetDescription} description
     */
    constructor(id: number, name: string, kind: TargetKind, { width, height, rgba, sizeMm: [widthMm, heightMm], mesh, grade }: TargetDescription);
}
/**
 * @param {string} message
 * @returns {DeepSftError}
 */
export declare function unknownTarget(message: string): DeepSftError;
