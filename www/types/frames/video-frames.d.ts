/** Tells when a video shows a frame that was not taken yet. */
export declare class VideoFrames {
    #private;
    /** How often the video has come to play something else: another camera, another file. */
    changes: number;
    /** When a frame last went by untaken, ms. */
    missedAt: number;
    /** @param {HTMLVideoElement} video */
    constructor(video: HTMLVideoElement);
    /**
     * Waits for a frame that was not taken yet; at once when one is there.
     *
     * @returns {Promise<number | null>} when it was shown, milliseconds of the page's clock, ascending; null once stopped
     */
    next(): Promise<number | null>;
    /** Whether there is a frame that was not taken yet. */
    get waiting(): boolean;
    stop(): void;
}
