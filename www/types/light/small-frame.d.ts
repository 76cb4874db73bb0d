/**
 * @param {ImageBitmap} frame
 * @returns {ImageData} of its shape, at most 160 pixels long
 */
export declare function smallPixels(frame: ImageBitmap): ImageData;
