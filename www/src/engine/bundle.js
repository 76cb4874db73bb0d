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
 * @param {URL} url
 * @param {AbortSignal} [signal]
 * @returns {Promise<Response>}
 */
async function fetchOrExplain(url, signal) {
  let response;
  try {
    response = await fetch(url, { signal });
  } catch (error) {
    signal?.throwIfAborted();
    throw new DeepSftError("model-load", `${url} could not be fetched: the network or the server failed.`, {
      cause: error,
    });
  }
  if (!response.ok)
    throw new DeepSftError("model-load", `${url} could not be fetched: the server answered ${response.status}.`);
  return response;
}

/**
 * The body of a response, counted while it arrives.
 *
 * @param {Response} response
 * @param {(bytes: number) => void} onBytes called with the length of each chunk
 * @returns {ReadableStream<Uint8Array<ArrayBuffer>> | null}
 */
export function countedBody(response, onBytes) {
  /** @type {TransformStream<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>} */
  const counter = new TransformStream({
    transform(chunk, controller) {
      onBytes(chunk.byteLength);
      controller.enqueue(chunk);
    },
  });
  return response.body && response.body.pipeThrough(counter);
}

/**
 * The files that `model.json` lists with their sizes in bytes.
 *
 * @param {Uint8Array} manifest
 * @param {URL} url for the message
 * @returns {Map<string, number>}
 */
function listedFiles(manifest, url) {
  let files;
  try {
    files = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(manifest)).files;
  } catch (error) {
    throw new DeepSftError("model-corrupt", `${url} is not JSON; is this the folder of a model?`, { cause: error });
  }
  if (typeof files !== "object" || files === null) {
    throw new DeepSftError("model-corrupt", `${url} lists no files.`);
  }
  const sizes = new Map();
  for (const [name, { size } = /** @type {any} */ ({})] of Object.entries(files)) {
    // Only plain relative names: a model must not make the page fetch from elsewhere.
    if (!/^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(name)) {
      throw new DeepSftError(
        "model-corrupt",
        `${url} names the file "${name}", which is not inside the model's folder.`,
      );
    }
    sizes.set(name, Number.isFinite(size) ? size : 0);
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
  const manifest = new Uint8Array(await (await fetchOrExplain(manifestUrl, signal)).arrayBuffer());
  const sizes = listedFiles(manifest, manifestUrl);
  const totalBytes = [...sizes.values()].reduce((sum, size) => sum + size, 0);
  let loadedBytes = 0;
  onProgress?.({ phase: "model", loadedBytes, totalBytes });
  const contents = await Promise.all(
    [...sizes.keys()].map(async (name) => {
      const url = new URL(name, folder);
      const body = countedBody(await fetchOrExplain(url, signal), (bytes) => {
        loadedBytes += bytes;
        onProgress?.({ phase: "model", loadedBytes, totalBytes });
      });
      try {
        return /** @type {const} */ ([name, new Uint8Array(await new Response(body).arrayBuffer())]);
      } catch (error) {
        signal?.throwIfAborted();
        throw new DeepSftError("model-load", `${url} broke off while it was fetched.`, { cause: error });
      }
    }),
  );
  return new Map([[MODEL_FILE, manifest], ...contents]);
}
