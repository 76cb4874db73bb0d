import type { Estimate } from "../results/estimate.js";
export type ViewVerdict = "taken" | "not-found" | "not-flat" | "not-tilted" | "too-similar";
export type View = {
    a: number[];
    b: number[];
    normal: number[];
};
/**
 * What became of a frame: `taken`, or why not.
 *
 * @typedef {"taken" | "not-found" | "not-flat" | "not-tilted" | "too-similar"} ViewVerdict
 */
/** @typedef {{ a: number[], b: number[], normal: number[] }} View equations a / f^2 + b = 0, and the sheet's normal */
/** Gathers views of the flat sheet until the focal length is known. */
export declare class FocalCalibration {
    #private;
    /** @param {{ widthMm: number, heightMm: number }} template size of the sheet */
    constructor({ widthMm, heightMm }: {
        widthMm: number;
        heightMm: number;
    });
    /** Views wanted. */
    get wanted(): number;
    /** Views taken. */
    get taken(): number;
    /**
     * Looks at one frame, all of the same camera and size.
     *
     * @param {Estimate} estimate
     * @returns {ViewVerdict}
     */
    add(estimate: Estimate): ViewVerdict;
    /**
     * The focal length in pixels of the images that were looked at, and its spread: the standard error by leaving one
     * view out at a time. Null until all views are taken, or when they contradict each other.
     *
     * @returns {{ focal: number, spread: number } | null}
     */
    result(): {
        focal: number;
        spread: number;
    } | null;
}
