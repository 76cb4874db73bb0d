import { DeepSftError } from "../error.js";
export type OpenCameraOptions = {
    /**
     * which way the camera should look; default "environment"
     */
    facing?: "environment" | "user";
    /**
     * a certain camera
     */
    deviceId?: string;
};
/**
 * A browser's refusal as an error with a code.
 *
 * @param {unknown} error
 * @returns {DeepSftError}
 */
export declare function cameraError(error: unknown): DeepSftError;
/** @param {MediaStream} stream */
export declare function stopStream(stream: MediaStream): void;
/**
 * A stream of the camera that is wanted, or, where no camera meets the wishes, of any.
 *
 * @param {OpenCameraOptions} options
 * @returns {Promise<MediaStream>}
 * @throws {DeepSftError} `camera-denied`, `camera-not-found`, `camera-busy`, `camera-constraints`, `insecure-context`
 */
export declare function requestStream({ facing, deviceId }: OpenCameraOptions): Promise<MediaStream>;
/**
 * A stream of this camera and no other.
 *
 * @param {string} deviceId
 * @returns {Promise<MediaStream>}
 * @throws {DeepSftError} as {@link requestStream}
 */
export declare function requestCamera(deviceId: string): Promise<MediaStream>;
