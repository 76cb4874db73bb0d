// Calls across to a worker, and their answers.

import { DeepSftError, asDeepSftError } from "../error.js";

/**
 * A module worker at `url`. From another origin (a CDN) it starts through a small script of this page's own.
 *
 * @param {URL} url
 * @returns {Worker}
 */
function startForeignWorker(url) {
  const script = new Blob([`import ${JSON.stringify(url.href)};`], { type: "text/javascript" });
  const blobUrl = URL.createObjectURL(script);
  const worker = new Worker(blobUrl, { type: "module", name: "deepsft" });
  worker.addEventListener("message", () => URL.revokeObjectURL(blobUrl), { once: true });
  return worker;
}

/** A worker with `worker.js` in it, as calls that return promises. */
export class WorkerCalls {
  /** @type {Worker} */
  #worker;
  /** @type {Map<number, { resolve: (value: any) => void, reject: (error: unknown) => void }>} */
  #waiting = new Map();
  #lastId = 0;
  #started = false;
  /** @type {{ reason: unknown } | null} why no call can be answered any more */
  #ended = null;

  /** @param {URL | undefined} url address of worker.js where the bundler cannot find it itself */
  constructor(url) {
    const own = new URL("../worker.js", import.meta.url);
    const foreign = url ?? (own.origin === self.location.origin ? undefined : own);
    // The literal form is what bundlers recognise.
    this.#worker =
      foreign === undefined
        ? new Worker(new URL("../worker.js", import.meta.url), { type: "module", name: "deepsft" })
        : foreign.origin === self.location.origin
          ? new Worker(foreign, { type: "module", name: "deepsft" })
          : startForeignWorker(foreign);
    this.#worker.addEventListener("message", ({ data: { id, value, error } }) => {
      const call = this.#waiting.get(id);
      this.#waiting.delete(id);
      if (error) call?.reject(asDeepSftError(error));
      else call?.resolve(value);
      this.#started = true;
    });
    this.#worker.addEventListener("error", (event) => {
      event.preventDefault();
      const reason =
        event.message || "its script could not be loaded; if a bundler moved it, pass its address as workerUrl";
      this.#end(new DeepSftError(this.#started ? "internal" : "engine-load", `The engine's worker failed: ${reason}.`));
    });
    this.#worker.addEventListener("messageerror", () =>
      this.#end(new DeepSftError("internal", "A message to the engine was lost.")),
    );
  }

  /**
   * Ends the worker; what is under way, and every later call, rejects with `reason`.
   *
   * @param {unknown} reason
   */
  terminate(reason) {
    this.#worker.terminate();
    this.#end(reason);
  }

  /**
   * @param {string} method of those that worker.js lists
   * @param {unknown} request
   * @param {Transferable[]} [transfer]
   * @returns {Promise<any>}
   */
  call(method, request, transfer = []) {
    if (this.#ended) return Promise.reject(this.#ended.reason);
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, method, request }, transfer);
    });
  }

  /** @param {unknown} reason */
  #end(reason) {
    this.#ended ??= { reason };
    for (const { reject } of this.#waiting.values()) reject(reason);
    this.#waiting.clear();
  }
}
