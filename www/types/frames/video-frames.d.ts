export type StallReason = "paused" | "ended" | "waiting" | "hidden" | "unknown";
/** Tells when a video shows a frame that was not taken yet. */
export declare class VideoFrames {
    #private;
    /** How often the video has come to play something else: another camera, another file. */
    changes: number;
    /** When a frame last went by untaken, ms. */
    missedAt: number;
    /** Whether frames that come too soon wait, and are not left out. */
    isPatient: boolean;
    /**
     * @param {HTMLVideoElement} video
     * @param {AbortSignal} signal stops it
     * @param {boolean} [software] whether its frames are read from memory where they lie there
     */
    constructor(video: HTMLVideoElement, signal: AbortSignal, software?: boolean);
    /**
     * Waits for a frame that was not taken yet; at once when one is there.
     *
     * @returns {Promise<number | null>} when it was shown, milliseconds of the page's clock, ascending; null once stopped
     */
    next(): Promise<number | null>;
    /**
     * What the video shows now.
     *
     * @returns {Promise<{ frame: ImageBitmap, width: number, height: number }>}
     * @throws {import("../error.js").DeepSftError} `image-unreadable`, `image-cross-origin`
     */
    grab(): Promise<{
        frame: ImageBitmap;
        width: number;
        height: number;
    }>;
    /** Whether there is a frame that was not taken yet. */
    get waiting(): boolean;
    /** So long no frame came, milliseconds; to be asked now and then, for it also looks whether the browser only fails to tell. */
    get silentMs(): number;
    /** Why. @returns {StallReason} */
    get silence(): StallReason;
}
