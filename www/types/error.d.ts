export type DeepSftErrorCode = typeof CODES[number];
/**
 * | code | when |
 * |---|---|
 * | `camera-denied` | the person or the system refused the camera |
 * | `camera-blocked` | a policy keeps the camera from the page: a frame without `allow="camera"`, a `Permissions-Policy` |
 * | `camera-not-found` | no camera is attached |
 * | `camera-busy` | another program or tab holds the camera, or it gives no picture |
 * | `camera-constraints` | no camera meets the constraints, even relaxed |
 * | `camera-lost` | the stream ended: unplugged, or permission withdrawn |
 * | `camera-intrinsics` | intrinsics that are no camera: a focal length of 0, NaN, or for another image size |
 * | `camera-unsupported` | the browser gives pages no camera, as in many apps that show pages |
 * | `play-refused` | the browser does not let the video play before the person has tapped something |
 * | `insecure-context` | the page is neither https nor localhost, so browsers offer no camera |
 * | `image-unreadable` | an image that is empty, broken, or not ready yet |
 * | `image-cross-origin` | an image or video of another origin, whose pixels the browser does not show |
 * | `browser-unsupported` | the browser lacks something that the engine cannot do without |
 * | `engine-load` | the WebAssembly module or the worker could not be loaded |
 * | `model-load` | a file of the model or template could not be fetched |
 * | `model-corrupt` | a file of the model is truncated or does not have the hash that `model.json` records |
 * | `model-version` | the model or template needs a newer version of this package |
 * | `webgpu-unavailable` | no WebGPU, no adapter, or one that the engine does not start on (only with `device: "webgpu"`) |
 * | `gpu-lost` | the GPU was lost and could not be started again, or was lost too often (only with `device: "webgpu"`) |
 * | `invalid-argument` | an argument that cannot be: a width of 0, a place beside the print, an element that the page does not have |
 * | `target-unusable` | a picture or template that cannot be looked for: blank, too small, of no sensible size, twice the same |
 * | `target-unknown` | a target that was removed, or of another estimator; or none was named and there is not just one |
 * | `closed` | the estimator was used after `close()` |
 * | `internal` | a defect of this package |
 *
 * @typedef {typeof CODES[number]} DeepSftErrorCode
 */
declare const CODES: readonly ["camera-denied", "camera-blocked", "camera-not-found", "camera-busy", "camera-constraints", "camera-lost", "camera-intrinsics", "camera-unsupported", "play-refused", "insecure-context", "image-unreadable", "image-cross-origin", "browser-unsupported", "engine-load", "model-load", "model-corrupt", "model-version", "webgpu-unavailable", "gpu-lost", "invalid-argument", "target-unusable", "target-unknown", "closed", "internal"];
/** What every function of this package throws or rejects with (except the reason of an aborted signal). */
export declare class DeepSftError extends Error {
    /** @type {DeepSftErrorCode} */
    code: DeepSftErrorCode;
    /**
     * @param {DeepSftErrorCode} code stable, for programs
     * @param {string} message a sentence, for people
     * @param {ErrorOptions} [options]
     */
    constructor(code: DeepSftErrorCode, message: string, options?: ErrorOptions);
}
/**
 * The same error as a `DeepSftError`: one already, one that carries a known `code` (from the worker or the
 * engine), or, for everything else, `internal`.
 *
 * @param {unknown} error
 */
export declare function asDeepSftError(error: unknown): DeepSftError;
/** @param {unknown} cause the browser's own refusal */
export declare function crossOriginError(cause: unknown): DeepSftError;
export {};
