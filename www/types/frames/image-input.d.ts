export type ImageInput = HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob;
/**
 * Images that are accepted. Compressed files go in as a Blob (a File is one).
 *
 * @typedef {HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob} ImageInput
 */
/**
 * Larger images are scaled down to this: the canonical image has 0.13 megapixels, and a 400 megapixel scan
 * would take 1.6 GB to read.
 */
export declare const MAX_PIXELS = 16777216;
/**
 * The image as something that can be transferred, at most {@link MAX_PIXELS} large.
 *
 * @param {ImageInput} image
 * @returns {Promise<{ frame: ImageBitmap | ImageData, width: number, height: number }>} width and height: of the image before it was made smaller
 * @throws {DeepSftError} `image-unreadable`
 */
export declare function transferableFrame(image: ImageInput): Promise<{
    frame: ImageBitmap | ImageData;
    width: number;
    height: number;
}>;
/**
 * Lets a frame's memory go. One that was sent to a worker has none left here.
 *
 * @param {ImageBitmap | ImageData} frame
 */
export declare function closeFrame(frame: ImageBitmap | ImageData): void;
