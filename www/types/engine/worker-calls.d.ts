/** A worker with `worker.js` in it, as calls that return promises. */
export declare class WorkerCalls {
    #private;
    /** @param {URL | undefined} url address of worker.js where the bundler cannot find it itself */
    constructor(url: URL | undefined);
    /**
     * Ends the worker; what is under way, and every later call, rejects with `reason`.
     *
     * @param {unknown} reason
     */
    terminate(reason: unknown): void;
    /**
     * @param {string} method of those that worker.js lists
     * @param {unknown} request
     * @param {Transferable[]} [transfer]
     * @returns {Promise<any>}
     */
    call(method: string, request: unknown, transfer?: Transferable[]): Promise<any>;
}
