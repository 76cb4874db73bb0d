/**
 * Bears frames of a video that cannot be read: browsers fail to grab one while a call interrupts the camera, the phone is
 * turned or a clip starts over, and the next one is fine.
 */
export declare class Patience {
    #private;
    /** To be called for each frame that was read. */
    reset(): void;
    /**
     * @param {unknown} error of a frame that could not be read
     * @throws {unknown} `error`, when it is not about the frame or frames have failed for too long
     */
    bear(error: unknown): void;
}
