// Fetching a model bundle: model.json and the files it lists, as far as this browser does not keep them. What is in them is the engine's
// to check.

import { fileIn } from "../address.js";
import { DeepSftError } from "../error.js";
import { KeptFiles, hasHash } from "./kept-files.js";

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
export const MODEL_FILE = "model.json";
const SHA256 = /^[0-9a-f]{64}$/;

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
export async function fetchBytes(url, signal, { onBytes = () => undefined, ...request } = {}) {
  try {
    const response = await fetch(url, { signal, ...request });
    if (!response.ok)
      throw new DeepSftError("model-load", `${url} could not be fetched: the server answered ${response.status}.`);
    const counted = response.clone().body?.pipeTo(new WritableStream({ write: ({ byteLength }) => onBytes(byteLength) }));
    const [bytes] = await Promise.all([response.arrayBuffer(), counted]);
    return new Uint8Array(bytes);
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof DeepSftError) throw error;
    throw new DeepSftError("model-load", `${url} could not be fetched: the network or the server failed.`, {
      cause: error,
    });
  }
}

/**
 * The files that `model.json` lists: sizes in bytes, and hashes where it gives them.
 *
 * @param {Uint8Array} manifest
 * @param {URL} url for the message
 */
function listedFiles(manifest, url) {
  let description;
  try {
    description = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(manifest));
  } catch (error) {
    throw new DeepSftError("model-corrupt", `${url} is not JSON; is this the folder of a model?`, { cause: error });
  }
  const corrupt = (/** @type {string} */ words) => new DeepSftError("model-corrupt", `${url} ${words}.`);
  const files = description?.files;
  if (typeof files !== "object" || files === null) throw corrupt("lists no files");
  const listed = new Map();
  for (const [name, entry] of Object.entries(files)) {
    // Only plain relative names: a model must not make the page fetch from elsewhere.
    if (!/^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(name)) throw corrupt(`names the file "${name}", which is not inside the model's folder`);
    const { size, sha256 } = Object(entry);
    if (!(Number.isInteger(size) && size >= 0)) throw corrupt(`gives the file "${name}" no size`);
    listed.set(name, { size, sha256: SHA256.test(sha256) ? sha256 : null });
  }
  return listed;
}

/**
 * Fetches a bundle. `model.json` is asked for each time, so that a bundle that has changed is noticed; the files that it lists are
 * taken from what this browser keeps, where their hashes are the same.
 *
 * @param {URL} folder ends in "/"
 * @param {Pick<LoadOptions, "onProgress" | "signal" | "keep" | "headers">} [options]
 * @returns {Promise<Map<string, Uint8Array>>} file name (relative, "/") to content
 * @throws {DeepSftError} `model-load`, `model-corrupt`
 */
export async function fetchBundle(folder, { onProgress, signal, keep = true, headers } = {}) {
  const manifestUrl = fileIn(folder, MODEL_FILE);
  const manifest = await fetchBytes(manifestUrl, signal, { cache: "no-cache", headers });
  const listed = listedFiles(manifest, manifestUrl);
  const kept = new KeptFiles(folder);
  if (keep) await kept.open();
  const totalBytes = [...listed.values()].reduce((sum, { size }) => sum + size, 0);
  let loadedBytes = 0;
  const onBytes = (/** @type {number} */ length) => {
    loadedBytes += length;
    onProgress?.({ phase: "model", loadedBytes, totalBytes });
  };
  onBytes(0);
  const contents = await Promise.all(
    [...listed].map(async ([name, { sha256 }]) => {
      let bytes = sha256 && (await kept.take(name, sha256));
      if (bytes) onBytes(bytes.byteLength);
      else {
        const url = fileIn(folder, name);
        bytes = await fetchBytes(url, signal, { onBytes, headers });
        // Insecure pages cannot compute hashes; the engine will.
        if (sha256 && crypto.subtle && !(await hasHash(bytes, sha256))) {
          // The browser's HTTP cache gave that of another version: once more from the server itself.
          onBytes(-bytes.byteLength);
          bytes = await fetchBytes(url, signal, { onBytes, headers, cache: "reload" });
        }
        if (sha256) await kept.keep(name, sha256, bytes);
      }
      return /** @type {const} */ ([name, bytes]);
    }),
  );
  await kept.dropOthers(listed);
  return new Map([[MODEL_FILE, manifest], ...contents]);
}

/**
 * Reads files.
 *
 * @param {Iterable<File>} files
 * @param {(file: File) => string} [nameOf] its own when absent
 * @returns {Promise<Map<string, Uint8Array>>}
 */
export async function filesByName(files, nameOf = ({ name }) => name) {
  const read = async (/** @type {File} */ file) => /** @type {const} */ ([nameOf(file), new Uint8Array(await file.arrayBuffer())]);
  return new Map(await Promise.all([...files].map(read)));
}

/**
 * The files of a bundle that the page has already, by their paths in its folder.
 *
 * @param {Iterable<File> | Map<string, Uint8Array>} input
 * @returns {Promise<Map<string, Uint8Array>>}
 * @throws {DeepSftError} `model-load`
 */
export async function bundleFiles(input) {
  const files = input instanceof Map ? input : await filesByName(input, ({ webkitRelativePath, name }) => webkitRelativePath || name);
  const manifest = [...files.keys()].find((name) => `/${name}`.endsWith(`/${MODEL_FILE}`));
  if (manifest === undefined) throw new DeepSftError("model-load", `There is no ${MODEL_FILE} among the files of the model.`);
  // An input for folders gives the folder's name too.
  const folder = manifest.slice(0, -MODEL_FILE.length);
  return new Map([...files].filter(([name]) => name.startsWith(folder)).map(([name, bytes]) => [name.slice(folder.length), bytes]));
}
