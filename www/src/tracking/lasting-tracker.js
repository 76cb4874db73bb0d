// The tracker as a video's loop holds it: where its worker dies, another one goes on.

import { CANONICAL_FOCAL } from "../camera/canonical.js";

/** @import { TargetRequest } from "../engine/engine-worker.js" */
/** @import { FinderAnswers, FollowRequest, TrackerStartRequest, TrackerWorker } from "./tracker-host.js" */

/** So many workers in a row may die without having heard an answer of the finders and followed a frame after it. */
const MAX_DEATHS = 2;

/** A tracker that outlives the death of its worker, with its targets. They are lost then, until the finders see them again. */
export class LastingTracker {
  #create;
  #request;
  #worker;
  #deaths = 0;
  /** Targets that were told to be found. @type {Set<string>} */
  #found = new Set();
  /** Who knows of the questions that the finders have not answered yet. @type {(TrackerWorker | undefined)[]} */
  #asked = [];
  /** Who has heard an answer. @type {TrackerWorker | null} */
  #hearing = null;
  #closed = false;

  /**
   * @param {() => TrackerWorker} create
   * @param {() => TrackerStartRequest} request what a worker starts with, now
   */
  constructor(create, request) {
    this.#create = create;
    this.#request = request;
    this.#worker = create();
  }

  start() {
    return this.#worker.call("startTracker", this.#request());
  }

  /** @param {TargetRequest} target */
  track(target) {
    return this.#run((worker) => worker.call("trackTarget", target));
  }

  /** @param {{ id: number }} request */
  untrack(request) {
    return this.#worker.call("untrackTarget", request);
  }

  /**
   * The meshes in a frame, and which targets are found, or no longer, since they were last told.
   *
   * @param {FollowRequest} request
   */
  async follow(request) {
    if (request.question) this.#asked.push(this.#worker);
    const followed = await this.#run((worker) => worker.call("follow", request));
    // Nothing is followed before the first answer: it is then that a worker has most to do.
    if (followed && this.#hearing === this.#worker) this.#deaths = 0;
    const tracked = followed ?? {
      // The worker died with it: nothing is found any more.
      targets: this.#request().targets.flatMap(({ id, source }) => {
        const copies = source.kind === "picture" ? source.copies : 1;
        return Array.from({ length: copies }, (_, copy) => ({ id, copy, found: false, held: false, surface: null, correlation: 0, iterations: 0 }));
      }),
      next: { focal: request.focal ?? CANONICAL_FOCAL, intervalMs: 0, question: null },
      afresh: true,
      focal: null,
      times: { warpMs: 0, trackMs: 0 },
      readMs: 0,
    };
    // A worker does not know what was told before it was started.
    const targets = tracked.targets.map((target) => ({ ...target, changed: target.found !== this.#found.has(named(target)) }));
    this.#found = new Set(targets.flatMap((target) => (target.found ? [named(target)] : [])));
    return { ...tracked, targets };
  }

  /** @param {FinderAnswers} request */
  async answer(request) {
    const worker = this.#worker;
    const heard = this.#asked.shift() === worker ? await this.#run((worker) => worker.call("answer", request)) : null;
    if (heard) this.#hearing = worker;
    return heard ?? { effects: [], next: null, answerMs: 0 };
  }

  /** @param {{ id: number }} request */
  maps(request) {
    return this.#worker.call("trackedMaps", request);
  }

  /**
   * Ends the worker for good; what is under way rejects with `reason`.
   *
   * @param {unknown} reason
   */
  terminate(reason) {
    this.#closed = true;
    this.#worker.terminate(reason);
  }

  /**
   * Has the worker do something.
   *
   * @template T
   * @param {(worker: TrackerWorker) => Promise<T>} work
   * @returns {Promise<T | null>} null where the worker died of it; another one has been started then
   */
  async #run(work) {
    const worker = this.#worker;
    try {
      return await work(worker);
    } catch (error) {
      if (this.#closed || !worker.hasEnded) throw error;
      // Another call may have seen it before.
      if (worker === this.#worker) {
        if (++this.#deaths > MAX_DEATHS) throw error;
        this.#worker = this.#create();
        // Calls wait for it in the worker; one that cannot start is dead for them too.
        this.start().catch((reason) => this.#worker.terminate(reason));
      }
      return null;
    }
  }
}

/** The name of a copy of a target. @param {{ id: number, copy: number }} target */
function named({ id, copy }) {
  return `${id} ${copy}`;
}
