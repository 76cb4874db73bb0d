// Fetching a model bundle: model.json and the files it lists. What is in them is the engine's to check.

import { DeepSftError } from "../error.js";

/**
 * How far loading has come. `engine` is the WebAssembly module, `model` the bundle, `start` the time in which
 * the device starts and the first, slow, frame runs. `totalBytes` is null where the server does not say.
 *
 * @typedef {object} LoadProgress
 * @property {"engine" | "model" | "start"} phase
 * @property {number} loadedBytes
 * @property {number | null} totalBytes
 */

const MODEL_FILE = "model.json";

/**
 * Fetches a file whole.
 *
 * @param {URL} url
 * @param {AbortSignal | undefined} signal
 * @param {(bytes: number) => void} [onBytes] called with the length of each chunk
 * @returns {Promise<Uint8Array>}
 * @throws {DeepSftError} `model-load`
 */
export async function fetchBytes(url, signal, onBytes = () => undefined) {
  try {
    const response = await fetch(url, { signal });
    if (!response.ok)
      throw new DeepSftError("model-load", `${url} could not be fetched: the server answered ${response.status}.`);
    const counter = new TransformStream({
      transform(chunk, controller) {
        onBytes(chunk.byteLength);
        controller.enqueue(chunk);
      },
    });
    return new Uint8Array(await new Response(response.body?.pipeThrough(counter)).arrayBuffer());
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof DeepSftError) throw error;
    throw new DeepSftError("model-load", `${url} could not be fetched: the network or the server failed.`, {
      cause: error,
    });
  }
}

/**
 * The files that `model.json` lists with their sizes in bytes.
 *
 * @param {Uint8Array} manifest
 * @param {URL} url for the message
 * @returns {Map<string, number>}
 */
function listedFiles(manifest, url) {
  let description;
  try {
    description = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(manifest));
  } catch (error) {
    throw new DeepSftError("model-corrupt", `${url} is not JSON; is this the folder of a model?`, { cause: error });
  }
  const files = description?.files;
  if (typeof files !== "object" || files === null) {
    throw new DeepSftError("model-corrupt", `${url} lists no files.`);
  }
  const sizes = new Map();
  for (const [name, entry] of Object.entries(files)) {
    // Only plain relative names: a model must not make the page fetch from elsewhere.
    if (!/^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(name)) {
      throw new DeepSftError(
        "model-corrupt",
        `${url} names the file "${name}", which is not inside the model's folder.`,
      );
    }
    const size = Object(entry).size;
    if (!(Number.isInteger(size) && size >= 0)) {
      throw new DeepSftError("model-corrupt", `${url} gives the file "${name}" no size.`);
    }
    sizes.set(name, size);
  }
  return sizes;
}

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
export async function fetchBundle(folder, { onProgress, signal } = {}) {
  const manifestUrl = new URL(MODEL_FILE, folder);
  const manifest = await fetchBytes(manifestUrl, signal);
  const sizes = listedFiles(manifest, manifestUrl);
  const totalBytes = [...sizes.values()].reduce((sum, size) => sum + size, 0);
  let loadedBytes = 0;
  onProgress?.({ phase: "model", loadedBytes, totalBytes });
  const contents = await Promise.all(
    [...sizes.keys()].map(async (name) => {
      const bytes = await fetchBytes(new URL(name, folder), signal, (length) => {
        loadedBytes += length;
        onProgress?.({ phase: "model", loadedBytes, totalBytes });
      });
      return /** @type {const} */ ([name, bytes]);
    }),
  );
  return new Map([[MODEL_FILE, manifest], ...contents]);
}
