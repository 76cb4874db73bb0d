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
 * @param {object} [options]
 * @param {(bytes: number) => void} [options.onBytes] called with the length of each chunk
 * @param {RequestCache} [options.cache] how to use what the browser has kept of earlier answers
 * @returns {Promise<Uint8Array<ArrayBuffer>>}
 * @throws {DeepSftError} `model-load`
 */
export declare function fetchBytes(url: URL, signal: AbortSignal | undefined, { onBytes, cache }?: {
    onBytes?: (bytes: number) => void;
    cache?: RequestCache;
}): Promise<Uint8Array<ArrayBuffer>>;
/**
 * Fetches a bundle. `model.json` is asked for each time, so that a bundle that has changed is noticed; the files that it lists are
 * taken from what this browser keeps, where their hashes are the same.
 *
 * @param {URL} folder ends in "/"
 * @param {object} [options]
 * @param {(progress: LoadProgress) => void} [options.onProgress]
 * @param {AbortSignal} [options.signal]
 * @param {boolean} [options.keep] whether to keep the files in this browser, and take what it keeps
 * @returns {Promise<Map<string, Uint8Array>>} file name (relative, "/") to content
 * @throws {DeepSftError} `model-load`, `model-corrupt`
 */
export declare function fetchBundle(folder: URL, { onProgress, signal, keep }?: {
    onProgress?: (progress: LoadProgress) => void;
    signal?: AbortSignal;
    keep?: boolean;
}): Promise<Map<string, Uint8Array>>;
