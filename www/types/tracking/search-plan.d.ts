import type { Target } from "../targets/target.js";
export type Searched = {
    target: Target;
    isFollowed: boolean;
    correlation: number;
    askedAt: number;
};
/** @typedef {{ target: Target, isFollowed: boolean, correlation: number, askedAt: number }} Searched */
/**
 * Spends the finders on the targets that are missing, in turn, as many at once as a search may take time for. A target that is
 * followed is confirmed now and then, at once when the image does not confirm it, and in between when nothing is missing and it
 * has a network, which also denies.
 */
export declare class SearchPlan {
    #private;
    /** @param {Target[]} targets */
    constructor(targets: Target[]);
    /** Whether some target is not followed. */
    get isMissingSome(): boolean;
    /** Whether some target is followed. */
    get isFollowingSome(): boolean;
    /**
     * Whether a search only confirms: each target has a network and is followed well. The canonical image is enough for it; features,
     * which find what is missing, need more pixels.
     *
     * @param {number[]} ids
     */
    onlyConfirms(ids: number[]): boolean;
    /**
     * What the tracker says of a target in its newest frame.
     *
     * @param {number} id
     * @param {boolean} isFollowed
     * @param {number} correlation
     * @returns {boolean} whether the target was just lost
     */
    tracked(id: number, isFollowed: boolean, correlation: number): boolean;
    /** @param {number} id of a target that is looked for no longer */
    remove(id: number): void;
    /**
     * The targets to look for now, by number; none when all are followed well.
     *
     * @param {number} nowMs
     * @returns {number[]}
     */
    next(nowMs: number): number[];
    /**
     * @param {number[]} ids of the targets that a search was for
     * @param {number} ms that it took
     * @param {boolean} [onlyConfirmed] whether it was one of {@link SearchPlan.onlyConfirms}
     */
    took(ids: number[], ms: number, onlyConfirmed?: boolean): void;
    /**
     * How long the finders rest now, milliseconds. They rest only while something is followed: what is followed they confirm, what is
     * missing everything waits for. A processor with too few cores for both serves the tracker first. On a device that has become
     * slow they work as small a part of the time as it has become slower: less heat, and the tracker keeps its rate.
     *
     * @param {number} ms that the last answer took, with what the tracker made of it
     * @param {boolean} isTrackerLate whether the tracker has missed frames of late
     */
    restMs(ms: number, isTrackerLate: boolean): number;
}
