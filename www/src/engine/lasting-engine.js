// The engine as the page holds it: started on what works, and started again where its GPU was lost or its worker died.

import { unlessAborted } from "../abort.js";
import { DeepSftError, asDeepSftError } from "../error.js";
import { MODEL_TARGET } from "../targets/target.js";
import { MODEL_FILE } from "./bundle.js";
import { WorkerCalls } from "./worker-calls.js";

/** @import { EngineInfo, EngineWorker, StartRequest, TargetDescription } from "./engine-worker.js" */
/** @import { TargetSource } from "../targets/target-source.js" */

/**
 * What is needed to start the engine again.
 *
 * @typedef {{ request: StartRequest, workerUrl: URL | undefined, timeoutMs: number | undefined }} StartPlan
 */

/** @typedef {{ worker: EngineWorker, info: EngineInfo, model: TargetDescription | null }} StartedEngine */

/**
 * A GPU that is lost sooner than this after its start may be broken, milliseconds. One that worked for longer was taken away: systems do
 * that to pages in the background, when they sleep and when a driver is renewed, and any number of times.
 */
const EARLY_MS = 60_000;
/** After so many early losses in a row the CPU does the work. */
const MAX_EARLY_LOSSES = 3;
/** What of a model's files, beside the first, its target is made of. */
const TEMPLATE_FOLDER = "template/";

/** An engine that outlives the loss of its GPU and the death of its worker, with its targets. */
export class LastingEngine {
  /** @type {EngineWorker} */
  #worker;
  /** When the engine was last started, milliseconds. */
  #startedAt = Date.now();
  /** How often in a row the GPU was lost soon after that. */
  #earlyLosses = 0;
  /** @type {Promise<void> | null} settles when the engine has been started again */
  #restarting = null;
  /** What its targets are made of, by number. @type {Map<number, TargetSource>} */
  sources = new Map();
  closed = false;

  /**
   * @param {StartPlan} plan
   * @param {StartedEngine} started with it
   */
  constructor(plan, { worker, info, model }) {
    this.plan = plan;
    this.#worker = worker;
    this.info = info;
    /** The model's target; null without a model. */
    this.model = model;
    const { files } = plan.request;
    if (!files) return;
    const needed = [...files].filter(([name]) => name === MODEL_FILE || name.startsWith(TEMPLATE_FOLDER));
    this.sources.set(MODEL_TARGET, { kind: "model", files: new Map(needed) });
  }

  /** @param {number} id */
  removeTarget(id) {
    this.sources.delete(id);
    // An engine that has ended has no targets either.
    this.#worker.call("removeTarget", { id }).catch(() => undefined);
  }

  /** Stops the worker; what is under way rejects with `closed`. */
  close() {
    this.closed = true;
    this.#worker.terminate(closedError());
  }

  /**
   * Has the engine do something; where it loses its GPU or its worker meanwhile, once more after it has been started again.
   *
   * @template T
   * @param {(worker: EngineWorker) => Promise<T>} work
   */
  async run(work) {
    for (let deaths = 0; ; ) {
      if (this.closed) throw closedError();
      const worker = this.#worker;
      try {
        return await work(worker);
      } catch (error) {
        const isLoss = asDeepSftError(error).code === "gpu-lost";
        if (this.closed || !(isLoss || worker.hasEnded)) throw error;
        // Another call may have seen it before.
        if (worker === this.#worker)
          await (this.#restarting ??= this.#restart(error).finally(() => (this.#restarting = null)));
        // A worker may die of another call; of the same one twice is no chance.
        if (!isLoss && ++deaths > 1) throw error;
      }
    }
  }

  /**
   * Starts the engine afresh: on the GPU, or, where that is lost again and again, on the CPU. A lost device poisons the engine's
   * whole module, so the worker goes with it.
   *
   * @param {unknown} reason the GPU's loss or the worker's death
   */
  async #restart(reason) {
    this.#worker.terminate(reason);
    const { code } = asDeepSftError(reason);
    if (code === "gpu-lost") this.#earlyLosses = Date.now() - this.#startedAt < EARLY_MS ? this.#earlyLosses + 1 : 0;
    const isBroken = this.#earlyLosses >= MAX_EARLY_LOSSES;
    const { request } = this.plan;
    const message = `The GPU was lost ${MAX_EARLY_LOSSES} times in a row, each time within a minute of its start.`;
    if (isBroken && request.device !== "auto") throw new DeepSftError("gpu-lost", message, { cause: reason });
    /** @type {StartedEngine | undefined} */
    let started;
    try {
      const device = isBroken ? "cpu" : request.device;
      started = await startEngine({ ...this.plan, request: { ...request, device } }, undefined);
      const added = [...this.sources].filter(([id]) => id !== MODEL_TARGET);
      for (const [id, source] of added) await started.worker.call("addTarget", { id, source });
      // Meanwhile some may have been removed.
      for (const [id] of added) if (!this.sources.has(id)) await started.worker.call("removeTarget", { id });
    } catch (cause) {
      started?.worker.terminate(cause);
      throw new DeepSftError(
        code,
        `${code === "gpu-lost" ? "The GPU was lost" : "The engine stopped"} and could not be started again: ${asDeepSftError(cause).message}`,
        { cause },
      );
    }
    if (this.closed) return started.worker.terminate(closedError());
    /** @type {EngineInfo["fallback"]} */
    const fallback = isBroken ? { code: "gpu-lost", message } : started.info.fallback;
    this.#startedAt = Date.now();
    [this.#worker, this.info] = [started.worker, { ...started.info, fallback }];
  }
}

/**
 * Starts a worker and its engine; under `auto`, when WebGPU promised well but the engine could not start on it, once
 * more on the CPU, in a fresh worker.
 *
 * @param {StartPlan} plan
 * @param {AbortSignal | undefined} signal
 * @returns {Promise<StartedEngine>}
 */
export async function startEngine({ request, workerUrl, timeoutMs }, signal) {
  signal?.throwIfAborted();
  /** @type {EngineWorker} */
  const worker = new WorkerCalls(workerUrl, timeoutMs);
  try {
    return { worker, ...(await unlessAborted(worker.call("start", request), signal)) };
  } catch (error) {
    worker.terminate(error);
    signal?.throwIfAborted();
    const { code, message } = asDeepSftError(error);
    const aboutTheGpu = code === "webgpu-unavailable" || code === "gpu-lost" || code === "internal";
    if (request.device !== "auto" || !aboutTheGpu) throw error;
    const started = await startEngine({ request: { ...request, device: "cpu" }, workerUrl, timeoutMs }, signal);
    return { ...started, info: { ...started.info, fallback: { code, message } } };
  }
}

export function closedError() {
  return new DeepSftError("closed", "The estimator was used after close().");
}
