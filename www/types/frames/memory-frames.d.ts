/** Grabs the frames of a video by way of the same memory, which stays: fresh pages for each frame cost as much as the conversion. */
export declare class MemoryFrames {
    #private;
    /**
     * The frame that a video shows.
     *
     * @param {HTMLVideoElement} video
     * @returns {Promise<{ frame: ImageBitmap, width: number, height: number } | null>} null where the browser has to draw it: it is turned,
     *   stretched, not in memory, or not there yet
     */
    grab(video: HTMLVideoElement): Promise<{
        frame: ImageBitmap;
        width: number;
        height: number;
    } | null>;
}
