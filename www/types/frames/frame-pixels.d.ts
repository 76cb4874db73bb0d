/**
 * The pixels of a frame, sRGB, not premultiplied, and how long it took to read them, milliseconds.
 *
 * @param {ImageBitmap | ImageData} frame
 * @throws {DeepSftError} `internal`
 */
export declare function readFrame(frame: ImageBitmap | ImageData): {
    rgba: ImageDataArray;
    width: number;
    height: number;
    readMs: number;
};
