// Calls across to a worker, and their answers.

import { DeepSftError, asDeepSftError, crossOriginError } from "../error.js";
import { VERSION } from "../version.js";

/** How long a worker may be silent while a call waits, milliseconds: an emulated GPU takes minutes for its first frame. */
export const DEFAULT_TIMEOUT_MS = 180_000;
const TICK_MS = 1000;
/** A worker that has answered a call of the same kind before may be silent for so many times as long, and at least for so many milliseconds. */
const PATIENCE = 20;
const LEAST_MS = 20_000;

/** The package's worker. Bundlers know only this form, and replace the address by that of their own file. */
const packagedWorker = () => new Worker(new URL("../worker.js", import.meta.url), { type: "module", name: "deepsft" });

/**
 * Starts a worker. Browsers refuse one from another origin (a CDN) with a SecurityError; it then starts through a small
 * script of this page's own.
 *
 * @param {URL | undefined} url address of worker.js; the package's own when absent
 * @throws {DeepSftError} `engine-load`
 */
function startWorker(url) {
  const plain = url === undefined ? packagedWorker : () => new Worker(url, { type: "module", name: "deepsft" });
  try {
    return asTrusted(plain);
  } catch (error) {
    try {
      if (error instanceof DOMException && error.name === "SecurityError") return asTrusted(() => throughOwnScript(plain));
    } catch {
      // The first refusal says more.
    }
    const reason = error instanceof Error || error instanceof DOMException ? error.message : error;
    throw new DeepSftError("engine-load", `The engine's worker could not be started: ${reason}`, { cause: error });
  }
}

/**
 * Repeats `start`, with another address in its call. Only `start` knows the address, as a bundler has written it there: it is read from
 * the call.
 *
 * @param {() => Worker} start
 * @param {(address: string, options: WorkerOptions) => string} replaced
 */
function withAddress(start, replaced) {
  const { Worker: PageWorker } = self;
  self.Worker = class extends PageWorker {
    /**
     * @param {string | URL} url
     * @param {WorkerOptions} [options]
     */
    constructor(url, options = {}) {
      super(replaced(new URL(url, self.location.href).href, options), options);
    }
  };
  try {
    return start();
  } finally {
    self.Worker = PageWorker;
  }
}

/**
 * Starts a script of this page, which imports that of `start`.
 *
 * @param {() => Worker} start
 */
function throughOwnScript(start) {
  let own = "";
  const worker = withAddress(start, (url, { type }) => {
    const address = JSON.stringify(url);
    // webpack makes classic scripts of module workers.
    const script = type === "module" ? `import ${address};` : `importScripts(${address});`;
    // A frame that has no origin starts no module from a blob.
    return (own = self.origin === "null" ? `data:text/javascript,${encodeURIComponent(script)}` : URL.createObjectURL(new Blob([script], { type: "text/javascript" })));
  });
  for (const event of ["message", "error"]) worker.addEventListener(event, () => URL.revokeObjectURL(own), { once: true });
  return worker;
}

/** @typedef {{ createPolicy: (name: string, rules: { createScriptURL: (url: string) => string }) => { createScriptURL: (url: string) => string } }} TrustedTypes */

/** Made once: a page that names it in its policy allows no second, unless it says so. @type {ReturnType<TrustedTypes["createPolicy"]> | null} */
let policy = null;

/**
 * Starts a worker whose address a policy of the page vouches for, as pages with Trusted Types require.
 *
 * @param {() => Worker} start
 */
function asTrusted(start) {
  const { trustedTypes } = /** @type {{ trustedTypes?: TrustedTypes }} */ (/** @type {unknown} */ (globalThis));
  try {
    policy ??= trustedTypes?.createPolicy("deepsft", { createScriptURL: (url) => url }) ?? null;
  } catch {
    // The page does not list it; then it may require none.
  }
  return policy ? withAddress(start, (url) => /** @type {NonNullable<typeof policy>} */ (policy).createScriptURL(url)) : start();
}

/**
 * A worker with `worker.js` in it, as calls that return promises.
 *
 * @template {Record<string, (request: any) => unknown>} Host what it can be asked to do
 */
export class WorkerCalls {
  /** @type {Worker} */
  #worker;
  /** @type {Map<number, { method: string, since: number, resolve: (value: any) => void, reject: (error: unknown) => void }>} */
  #waiting = new Map();
  /** The longest that each kind of call took, milliseconds. @type {Map<string, number>} */
  #longestMs = new Map();
  #lastId = 0;
  #started = false;
  /** Why no call can be answered any more. @type {unknown} */
  #reason;
  hasEnded = false;
  /** So long nothing was heard while calls wait, milliseconds. */
  #silentMs = 0;
  #clock;

  /**
   * @param {URL | undefined} url address of worker.js where the bundler does not find it
   * @param {number} [timeoutMs] the worker is ended when it is silent for so long while a call waits
   * @throws {DeepSftError} `engine-load`
   */
  constructor(url, timeoutMs = DEFAULT_TIMEOUT_MS) {
    this.#worker = startWorker(url);
    // Ticks are counted rather than clock time: while a phone sleeps the page stands still as the worker does.
    const tickMs = Math.min(TICK_MS, timeoutMs);
    this.#clock = setInterval(() => {
      if (this.#waiting.size === 0) return;
      const allowed = Math.max(...[...this.#waiting.values()].map(({ method }) => PATIENCE * (this.#longestMs.get(method) ?? Infinity)));
      const limitMs = Math.min(timeoutMs, Math.max(LEAST_MS, allowed));
      if ((this.#silentMs += tickMs) <= limitMs) return;
      const seconds = Math.round(limitMs / 1000);
      this.terminate(new DeepSftError("internal", `The engine's worker was silent for ${seconds} s and was stopped.`));
    }, tickMs);
    this.#worker.addEventListener("message", ({ data: { id, value, error, fatal } }) => {
      const call = this.#waiting.get(id);
      this.#waiting.delete(id);
      this.#silentMs = 0;
      this.#started = true;
      if (call && !error) this.#longestMs.set(call.method, Math.max(performance.now() - call.since, this.#longestMs.get(call.method) ?? 0));
      if (error) call?.reject(asDeepSftError(error));
      else call?.resolve(value);
      if (fatal) this.terminate(asDeepSftError(error));
    });
    this.#worker.addEventListener("error", (event) => {
      event.preventDefault();
      const remedy = globalThis.crossOriginIsolated
        ? "the page is cross-origin isolated, so the server must send Cross-Origin-Embedder-Policy with the package's scripts too"
        : "if a bundler does not find it, serve a copy of the package's folder dist and pass its address as baseUrl";
      const reason = event.message || `its script could not be loaded; ${remedy}`;
      this.terminate(new DeepSftError(this.#started ? "internal" : "engine-load", `The engine's worker failed: ${reason}.`));
    });
    this.#worker.addEventListener("messageerror", () =>
      this.terminate(new DeepSftError("internal", "A message to the engine was lost.")),
    );
  }

  /**
   * Ends the worker; what is under way, and every later call, rejects with `reason`, or with that of the first end.
   *
   * @param {unknown} reason
   */
  terminate(reason) {
    clearInterval(this.#clock);
    this.#worker.terminate();
    if (!this.hasEnded) this.#reason = reason;
    this.hasEnded = true;
    for (const { reject } of this.#waiting.values()) reject(reason);
    this.#waiting.clear();
  }

  /**
   * Asks the worker to do one of its things. A bitmap or pixels that are asked about go over to it.
   *
   * @template {keyof Host & string} Method
   * @param {Method} method
   * @param {Parameters<Host[Method]>[0]} request
   * @returns {Promise<Awaited<ReturnType<Host[Method]>>>}
   */
  call(method, request) {
    if (this.hasEnded) return Promise.reject(this.#reason);
    const id = ++this.#lastId;
    const { frame } = /** @type {{ frame?: ImageBitmap | ImageData }} */ (request);
    try {
      this.#worker.postMessage({ id, method, request, version: VERSION }, frame ? [frame instanceof ImageBitmap ? frame : frame.data.buffer] : []);
    } catch (error) {
      // Of what is sent only pictures can be refused.
      return Promise.reject(error instanceof DOMException && error.name === "DataCloneError" ? crossOriginError(error) : asDeepSftError(error));
    }
    if (this.#waiting.size === 0) this.#silentMs = 0;
    return new Promise((resolve, reject) => this.#waiting.set(id, { method, since: performance.now(), resolve, reject }));
  }
}
