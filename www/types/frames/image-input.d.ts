export type ReadImage = HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob;
export type ImageInput = ReadImage | string | URL;
/** @typedef {HTMLVideoElement | HTMLImageElement | HTMLCanvasElement | OffscreenCanvas | ImageBitmap | ImageData | VideoFrame | Blob} ReadImage */
/**
 * Images that are accepted. Compressed files go in as an address, relative to the page, or as a Blob (a File is one). An `<img>` that
 * still loads is waited for.
 *
 * @typedef {ReadImage | string | URL} ImageInput
 */
/**
 * Larger images are scaled down to this: the canonical image has 0.13 megapixels, and a 400 megapixel scan
 * would take 1.6 GB to read.
 */
export declare const MAX_PIXELS = 16777216;
/**
 * The image of an address, fetched; others as they are.
 *
 * @param {ImageInput} image
 * @param {AbortSignal} [signal]
 * @throws {DeepSftError} `image-unreadable`
 */
export declare function readImage(image: ImageInput, signal?: AbortSignal): Promise<ReadImage>;
/**
 * The image as something that can be transferred, at most {@link MAX_PIXELS} large.
 *
 * @param {ReadImage} image
 * @returns {Promise<{ frame: ImageBitmap | ImageData, width: number, height: number }>} width and height: of the image before it was made smaller
 * @throws {DeepSftError} `image-unreadable`
 */
export declare function transferableFrame(image: ReadImage): Promise<{
    frame: ImageBitmap | ImageData;
    width: number;
    height: number;
}>;
/**
 * A picture as it looks on white paper, made smaller where it is larger than `longestSide`.
 *
 * @param {ImageBitmap | ImageData} frame
 * @param {number} longestSide pixels
 * @throws {DeepSftError} `internal`, `image-cross-origin`
 */
export declare function opaquePixels(frame: ImageBitmap | ImageData, longestSide: number): Promise<ImageData>;
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
/**
 * Decodes a picture's file, of any kind that the browser knows.
 *
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @throws {DeepSftError} `image-unreadable`, `internal`
 */
export declare function decodedPixels(bytes: Uint8Array<ArrayBuffer>): Promise<ImageData>;
/**
 * Tells why this browser cannot read a file as a picture, and what to do.
 *
 * @param {Blob} file that could not be read
 * @returns {Promise<string>} "it is ...", and what to do, without the full stop
 */
export declare function whyUnreadable(file: Blob): Promise<string>;
/**
 * Lets a frame's memory go. One that was sent to a worker has none left here.
 *
 * @param {ImageBitmap | ImageData} frame
 */
export declare function closeFrame(frame: ImageBitmap | ImageData): void;
