/** Tells when a video shows a frame that was not taken yet. */
export declare class VideoFrames {
    #private;
    /** @param {HTMLVideoElement} video */
    constructor(video: HTMLVideoElement);
    /**
     * Waits for a frame that was not taken yet; at once when one is there.
     *
     * @returns {Promise<number | null>} when it was shown, milliseconds of the page's clock, ascending; null once stopped
     */
    next(): Promise<number | null>;
    /** How many frames went by untaken since the last time this was asked. */
    takeMissed(): number;
    stop(): void;
}
