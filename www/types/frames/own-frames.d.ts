export type OwnFrame = {
    frame: VideoFrame | ImageBitmap | HTMLCanvasElement | OffscreenCanvas;
    timeMs: number;
};
/**
 * A frame of one's own. It is copied before the next one is asked for, and closing it stays with who made it. Times ascend.
 *
 * @typedef {{ frame: VideoFrame | ImageBitmap | HTMLCanvasElement | OffscreenCanvas, timeMs: number }} OwnFrame
 */
/** Gives the frames of an iterable, every one of them. */
export declare class OwnFrames {
    #private;
    /** As of a video, which may come to play something else, and whose frames may wait or go by untaken. */
    changes: number;
    waiting: boolean;
    missedAt: number;
    /** Whether frames that come too soon wait, and are not left out. */
    isPatient: boolean;
    /**
     * @param {AsyncIterable<OwnFrame>} source
     * @param {AbortSignal} signal stops it
     */
    constructor(source: AsyncIterable<OwnFrame>, signal: AbortSignal);
    /**
     * @returns {Promise<number | null>} time of the next frame, milliseconds; null once stopped, and after the last one
     * @throws {DeepSftError} `image-unreadable`
     */
    next(): Promise<number | null>;
    /** @returns {Promise<{ frame: ImageBitmap, width: number, height: number }>} a copy of the newest frame */
    grab(): Promise<{
        frame: ImageBitmap;
        width: number;
        height: number;
    }>;
    /** So long no frame came, milliseconds. */
    get silentMs(): number;
    /** Why. @returns {import("./video-frames.js").StallReason} */
    get silence(): import("./video-frames.js").StallReason;
}
