/**
 * The pixels of a frame, sRGB, not premultiplied.
 *
 * @param {ImageBitmap | ImageData} frame
 * @returns {Uint8ClampedArray}
 * @throws {DeepSftError} `internal`
 */
export declare function framePixels(frame: ImageBitmap | ImageData): Uint8ClampedArray;
