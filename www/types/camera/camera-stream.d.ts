import { DeepSftError } from "../error.js";
import type { SourcedCamera } from "./intrinsics.js";
import type { OpenCameraOptions } from "./request.js";
/**
 * Opens a camera and plays it in a video element.
 *
 * @param {HTMLVideoElement} video must be in the document (iOS plays no other); it is set to play inline and muted
 * @param {OpenCameraOptions} [options]
 * @returns {Promise<CameraStream>}
 * @throws {DeepSftError} `camera-denied`, `camera-not-found`, `camera-busy`, `camera-constraints`, `insecure-context`, `camera-lost`
 */
export declare function openCamera(video: HTMLVideoElement, options?: OpenCameraOptions): Promise<CameraStream>;
/**
 * The cameras there are. Labels are empty until a camera was allowed once.
 *
 * @returns {Promise<{ deviceId: string, label: string }[]>}
 */
export declare function listCameras(): Promise<{
    deviceId: string;
    label: string;
}[]>;
/**
 * A camera that plays. Events:
 *
 * - `interrupted`, when the system takes the camera away for a while: a phone call, a locked screen, another tab;
 * - `resumed`, when it plays again after that, opened anew if need be;
 * - `lost`, when it ended by itself (`error` then says why);
 * - `resize`, when the picture's size changed because the device was turned; the intrinsics follow by themselves.
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
    /** Ends the stream and frees the camera. */
    stop(): void;
}
