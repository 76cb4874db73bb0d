export type LoadProgress = {
    phase: "engine" | "model" | "start";
    loadedBytes: number;
    totalBytes: number | null;
};
export type LoadOptions = {
    /**
     * `auto` (the default) takes WebGPU when a real GPU offers what the engine
     * needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
     */
    device?: "auto" | "webgpu" | "cpu";
    onProgress?: (progress: LoadProgress) => void;
    /**
     * whether this browser keeps the model's files, in its Cache storage by their SHA-256, so that the next visit
     * asks for `model.json` alone; default true. Where there is no such storage, or no room, they are fetched each time.
     */
    keep?: boolean;
    /**
     * of the requests for the model's files, as of a server that asks who it is
     */
    headers?: HeadersInit;
    /**
     * stops loading; the promise then rejects with the signal's reason
     */
    signal?: AbortSignal;
    /**
     * address of a copy of this package's folder `dist`, whose worker and engine are taken, where a bundler does
     * not find them
     */
    baseUrl?: string | URL;
    /**
     * so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
     * hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
     */
    timeoutMs?: number;
};
/**
 * How far loading has come. `engine` is the WebAssembly module, `model` the bundle, `start` the time in which
 * the device starts and the first, slow, frame runs. `totalBytes` is null where the server does not say.
 *
 * @typedef {object} LoadProgress
 * @property {"engine" | "model" | "start"} phase
 * @property {number} loadedBytes
 * @property {number | null} totalBytes
 */
/**
 * @typedef {object} LoadOptions
 * @property {"auto" | "webgpu" | "cpu"} [device] `auto` (the default) takes WebGPU when a real GPU offers what the engine
 *   needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
 * @property {(progress: LoadProgress) => void} [onProgress]
 * @property {boolean} [keep] whether this browser keeps the model's files, in its Cache storage by their SHA-256, so that the next visit
 *   asks for `model.json` alone; default true. Where there is no such storage, or no room, they are fetched each time.
 * @property {HeadersInit} [headers] of the requests for the model's files, as of a server that asks who it is
 * @property {AbortSignal} [signal] stops loading; the promise then rejects with the signal's reason
 * @property {string | URL} [baseUrl] address of a copy of this package's folder `dist`, whose worker and engine are taken, where a bundler does
 *   not find them
 * @property {number} [timeoutMs] so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
 *   hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
 */
/** What describes a model, in its folder. */
export declare const MODEL_FILE = "model.json";
export type ModelInput = string | URL | Iterable<File> | Map<string, Uint8Array>;
/**
 * A model: its folder's address, relative to the page, or its files: as an input for folders gives them, or by their paths in the folder.
 *
 * @typedef {string | URL | Iterable<File> | Map<string, Uint8Array>} ModelInput
 */
/**
 * Fetches a file whole.
 *
 * @param {URL} url
 * @param {AbortSignal | undefined} signal
 * @param {object} [options]
 * @param {(bytes: number) => void} [options.onBytes] called with the length of each chunk
 * @param {RequestCache} [options.cache] how to use what the browser has kept of earlier answers
 * @param {HeadersInit} [options.headers] of the request
 * @throws {DeepSftError} `model-load`
 */
export declare function fetchBytes(url: URL, signal: AbortSignal | undefined, { onBytes, ...request }?: {
    onBytes?: (bytes: number) => void;
    cache?: RequestCache;
    headers?: HeadersInit;
}): Promise<Uint8Array<ArrayBuffer>>;
/**
 * Fetches a bundle. `model.json` is asked for each time, so that a bundle that has changed is noticed; the files that it lists are
 * taken from what this browser keeps, where their hashes are the same.
 *
 * @param {URL} folder ends in "/"
 * @param {Pick<LoadOptions, "onProgress" | "signal" | "keep" | "headers">} [options]
 * @returns {Promise<Map<string, Uint8Array>>} file name (relative, "/") to content
 * @throws {DeepSftError} `model-load`, `model-corrupt`
 */
export declare function fetchBundle(folder: URL, { onProgress, signal, keep, headers }?: Pick<LoadOptions, "onProgress" | "signal" | "keep" | "headers">): Promise<Map<string, Uint8Array>>;
/**
 * Reads files.
 *
 * @param {Iterable<File>} files
 * @param {(file: File) => string} [nameOf] its own when absent
 * @returns {Promise<Map<string, Uint8Array>>}
 */
export declare function filesByName(files: Iterable<File>, nameOf?: (file: File) => string): Promise<Map<string, Uint8Array>>;
/**
 * The files of a bundle that the page has already, by their paths in its folder.
 *
 * @param {Iterable<File> | Map<string, Uint8Array>} input
 * @returns {Promise<Map<string, Uint8Array>>}
 * @throws {DeepSftError} `model-load`
 */
export declare function bundleFiles(input: Iterable<File> | Map<string, Uint8Array>): Promise<Map<string, Uint8Array>>;
