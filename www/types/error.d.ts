export type DeepSftErrorCode = "camera-denied" | "camera-blocked" | "camera-not-found" | "camera-busy" | "camera-constraints" | "camera-lost" | "camera-intrinsics" | "camera-unsupported" | "play-refused" | "insecure-context" | "image-unreadable" | "image-cross-origin" | "browser-unsupported" | "engine-load" | "model-load" | "model-corrupt" | "model-version" | "webgpu-unavailable" | "gpu-lost" | "invalid-argument" | "target-unusable" | "target-unknown" | "closed" | "internal";
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
 * engine), or, for everything else, code `fallback`.
 *
 * @param {unknown} error
 * @param {DeepSftErrorCode} [fallback]
 * @returns {DeepSftError}
 */
export declare function asDeepSftError(error: unknown, fallback?: DeepSftErrorCode): DeepSftError;
/**
 * @param {unknown} cause the browser's own refusal
 * @returns {DeepSftError}
 */
export declare function crossOriginError(cause: unknown): DeepSftError;
