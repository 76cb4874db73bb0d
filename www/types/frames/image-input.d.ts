export type ImageInput = HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob;
/**
 * The image as something that can be transferred, at most {@link MOST_PIXELS} large.
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
