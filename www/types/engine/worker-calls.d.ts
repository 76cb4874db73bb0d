/** How long a worker may be silent while a call waits, milliseconds: an emulated GPU takes minutes for its first frame. */
export declare const DEFAULT_TIMEOUT_MS = 180000;
export type TrustedTypes = {
    createPolicy: (name: string, rules: {
        createScriptURL: (url: string) => string;
    }) => {
        createScriptURL: (url: string) => string;
    };
};
/** A worker with `worker.js` in it, as calls that return promises. */
export declare class WorkerCalls {
    #private;
    /**
     * @param {URL | undefined} url address of worker.js where the bundler does not find it
     * @param {number} [timeoutMs] the worker is ended when it is silent for so long while a call waits
     * @throws {DeepSftError} `engine-load`
     */
    constructor(url: URL | undefined, timeoutMs?: number);
    /** Whether no call can be answered any more. */
    get hasEnded(): boolean;
    /**
     * Ends the worker; what is under way, and every later call, rejects with `reason`, or with that of the first end.
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
