import { DeepSftError } from "../error.js";
import type { MeshTopology, TargetDescription } from "../engine/engine-worker.js";
export type TargetKind = "picture" | "template" | "model";
/** @import { MeshTopology, TargetDescription } from "../engine/engine-worker.js" */
/**
 * Where a target comes from: a picture that was added, a template's folder, or a model, which brings a network of its own.
 *
 * @typedef {"picture" | "template" | "model"} TargetKind
 */
/** Number of the model's target. */
export declare const MODEL_TARGET = 0;
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
    /**
     * What lengths of it are counted in, depths and distances too: millimetres, or, of a print whose size is not known, its width.
     *
     * @type {"mm" | "width"}
     */
    unit: "mm" | "width";
    /** Width of the flat print; NaN where it is not known. */
    widthMm: number;
    /** Its height; likewise. */
    heightMm: number;
    /**
     * What of its mesh no frame changes.
     *
     * @type {MeshTopology}
     */
    mesh: MeshTopology;
    /**
     * The targets that its picture resembled when it was added, the most alike first, and the share of corners that they have in common, 0 to 1.
     * In one place of an image only the better one counts as found.
     *
     * @type {{ target: Target, share: number }[]}
     */
    alike: {
        target: Target;
        share: number;
    }[];
    /** How well features will find it, said before it is printed; null of a model's target, which has a network. */
    grade: {
        level: "hopeless" | "poor" | "fair" | "good";
        reasons: string[];
    } | null;
    /**
     * @param {number} id
     * @param {string} name
     * @param {TargetKind} kind
     * @param {TargetDescription} description
     * @param {boolean} [hasSize] whether the size is that of the print, and not one that was made up
     */
    constructor(id: number, name: string, kind: TargetKind, { width, height, rgba, sizeMm: [widthMm, heightMm], mesh, grade }: TargetDescription, hasSize?: boolean);
}
/** @param {string} message */
export declare function unknownTarget(message: string): DeepSftError;
