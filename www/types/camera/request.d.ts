export type Facing = "environment" | "user";
export type OpenCameraOptions = {
    /**
     * which way the camera should look; default "environment"
     */
    facing?: Facing;
    /**
     * a certain camera; where it is not there any more, one that looks the wanted way
     */
    deviceId?: string;
    /**
     * closes the camera, or ends its opening, which then rejects with the signal's reason
     */
    signal?: AbortSignal;
};
/** @param {MediaStream} stream */
export declare function stopStream(stream: MediaStream): void;
/**
 * A stream of the camera that is wanted, or, where no camera meets the wishes, of any.
 *
 * @param {OpenCameraOptions} options
 * @throws {DeepSftError} `camera-denied`, `camera-blocked`, `camera-not-found`, `camera-busy`, `camera-constraints`, `camera-unsupported`, `insecure-context`
 */
export declare function requestStream({ facing, deviceId }: OpenCameraOptions): Promise<MediaStream>;
/**
 * A stream of this camera and no other.
 *
 * @param {string} deviceId
 * @throws {DeepSftError} as {@link requestStream}
 */
export declare function requestCamera(deviceId: string): Promise<MediaStream>;
/**
 * A stream of a camera that looks this way; of several back cameras the main one, where the browser tells them apart.
 *
 * @param {Facing} facing
 * @param {"exact" | "ideal"} [strictness] whether one that looks another way will not do
 * @throws {DeepSftError} as {@link requestStream}
 */
export declare function requestFacing(facing: Facing, strictness?: "exact" | "ideal"): Promise<MediaStream>;
/**
 * Which way a camera looks: as its capabilities say, else as Chrome on Android and an English Safari name it.
 *
 * @param {MediaDeviceInfo} device
 * @returns {Facing | ""}
 */
export declare function facingOf(device: MediaDeviceInfo): Facing | "";
