export type LoadProgress = {
    phase: "engine" | "model" | "start";
    loadedBytes: number;
    totalBytes: number | null;
};
/**
 * Fetches a file whole.
 *
 * @param {URL} url
 * @param {AbortSignal | undefined} signal
 * @param {(bytes: number) => void} [onBytes] called with the length of each chunk
 * @returns {Promise<Uint8Array>}
 * @throws {DeepSftError} `model-load`
 */
export declare function fetchBytes(url: URL, signal: AbortSignal | undefined, onBytes?: (bytes: number) => void): Promise<Uint8Array>;
/**
 * Fetches a bundle.
 *
 * @param {URL} folder ends in "/"
 * @param {object} [options]
 * @param {(progress: LoadProgress) => void} [options.onProgress]
 * @param {AbortSignal} [options.signal]
 * @returns {Promise<Map<string, Uint8Array>>} file name (relative, "/") to content
 * @throws {DeepSftError} `model-load`, `model-corrupt`
 */
export declare function fetchBundle(folder: URL, { onProgress, signal }?: {
    onProgress?: (progress: LoadProgress) => void;
    signal?: AbortSignal;
}): Promise<Map<string, Uint8Array>>;
