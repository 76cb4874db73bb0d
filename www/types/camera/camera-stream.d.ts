import { DeepSftError } from "../error.js";
import type { SourcedCamera } from "./intrinsics.js";
import type { Facing, OpenCameraOptions } from "./request.js";
/**
 * Opens a camera and plays it in a video element.
 *
 * @param {HTMLVideoElement} video must be in the document (iOS plays no other); it is set to play inline and muted
 * @param {OpenCameraOptions} [options]
 * @throws {DeepSftError} `camera-denied`, `camera-blocked`, `camera-not-found`, `camera-busy`, `camera-constraints`, `camera-unsupported`,
 *   `insecure-context`, `camera-lost`, `play-refused`, `closed` where something else was given to the video meanwhile
 */
export declare function openCamera(video: HTMLVideoElement, { signal, ...wanted }?: OpenCameraOptions): Promise<CameraStream>;
export type ListedCamera = {
    deviceId: string;
    label: string;
    facing: Facing | "";
};
/**
 * A camera there is; `facing` is "" where the browser does not tell which way it looks.
 *
 * @typedef {{ deviceId: string, label: string, facing: Facing | "" }} ListedCamera
 */
/**
 * The cameras there are. All three fields may be empty until a camera was allowed once.
 *
 * @returns {Promise<ListedCamera[]>}
 */
export declare function listCameras(): Promise<ListedCamera[]>;
/**
 * A camera that plays. Events:
 *
 * - `interrupted`, when the system takes the camera away for a while: a phone call, a locked screen, another tab;
 * - `resumed`, when it plays again after that, opened anew if need be;
 * - `lost`, when it ended by itself (`error` then says why);
 * - `switched`, when another camera has taken its place by {@link CameraStream.switchTo};
 * - `resize`, when the picture's size changed because the device was turned, or another camera has another size; the intrinsics follow by themselves.
 */
export declare class CameraStream extends EventTarget {
    #private;
    /** @type {DeepSftError | null} why the stream ended by itself */
    error: DeepSftError | null;
    /** Whether the system has taken the camera away for a while. */
    interrupted: boolean;
    /**
     * Use {@link openCamera}.
     *
     * @param {HTMLVideoElement} video
     * @param {MediaStream} stream
     */
    constructor(video: HTMLVideoElement, stream: MediaStream);
    /** The element it plays in. */
    get video(): HTMLVideoElement;
    /** Aborted when it was closed, or is lost, with why. */
    get signal(): AbortSignal;
    /** Plays the stream; called by {@link openCamera}. */
    start(): Promise<void>;
    /** Name of the camera. */
    get label(): string;
    /** Which way it looks, where the browser tells. */
    get facing(): string;
    /** Identifier of the camera, for {@link OpenCameraOptions}. */
    get deviceId(): string;
    /**
     * The camera for images of a size, from its calibration in this browser or else estimated. A function that can be
     * passed as the `camera` option as it is: it is asked anew for each frame, so it follows a phone that is turned.
     *
     * @type {(width: number, height: number) => SourcedCamera}
     */
    intrinsics: (width: number, height: number) => SourcedCamera;
    /**
     * Keeps a focal length for this camera at this image size, in this browser, unless a surer one is kept already; null forgets it.
     *
     * @param {number} width pixels
     * @param {number} height pixels
     * @param {number | null} focal pixels
     * @param {number | null} [spread] its standard deviation, pixels; without one it takes the place of any other
     * @returns {boolean} whether it is what is kept now
     */
    calibrate(width: number, height: number, focal: number | null, spread?: number | null): boolean;
    /**
     * Plays another camera in the same video, so that what follows the video goes on. Switches called meanwhile happen in turn.
     * Interruptions from then on are about the new camera. One that does not open leaves the former one playing.
     *
     * @param {{ deviceId: string } | { facing: Facing }} wanted a certain camera, or one that looks this way
     * @returns {Promise<void>} once its first frame is there
     * @throws {DeepSftError} as {@link openCamera}; `camera-lost` when the former one does not open again either
     */
    switchTo(wanted: {
        deviceId: string;
    } | {
        facing: Facing;
    }): Promise<void>;
    /** Ends the stream and frees the camera. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
}
