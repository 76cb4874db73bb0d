import type { Estimate } from "../results/estimate.js";
/** @import { Estimate } from "../results/estimate.js" */
/** A running loop over a video's frames. */
export declare class Tracking {
    #private;
    /**
     * Resolves when the loop was stopped; rejects with what ended it otherwise, an error of the estimator or one that
     * the callback threw.
     *
     * @type {Promise<void>}
     */
    finished: Promise<void>;
    /**
     * @param {HTMLVideoElement} video
     * @param {() => Promise<Estimate | null>} estimate of the frame the video shows now
     * @param {(estimate: Estimate) => void} onEstimate
     */
    constructor(video: HTMLVideoElement, estimate: () => Promise<Estimate | null>, onEstimate: (estimate: Estimate) => void);
    /** Ends the loop; the callback is not called again. */
    stop(): void;
}
