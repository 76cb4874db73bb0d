/** How long a worker may be silent while a call waits, milliseconds: an emulated GPU takes minutes for its first frame. */
export declare const DEFAULT_TIMEOUT_MS = 180000;
export type TrustedTypes = {
    createPolicy: (name: string, rules: {
        createScriptURL: (url: string) => string;
    }) => {
        createScriptURL: (url: string) => string;
    };
};
/**
 * A worker with `worker.js` in it, as calls that return promises.
 *
 * @template {Record<string, (request: any) => unknown>} Host what it can be asked to do
 */
export declare class WorkerCalls<Host extends Record<string, (request: any) => unknown>> {
    #private;
    hasEnded: boolean;
    /**
     * @param {URL | undefined} url address of worker.js where the bundler does not find it
     * @param {number} [timeoutMs] the worker is ended when it is silent for so long while a call waits
     * @throws {DeepSftError} `engine-load`
     */
    constructor(url: URL | undefined, timeoutMs?: number);
    /**
     * Ends the worker; what is under way, and every later call, rejects with `reason`, or with that of the first end.
     *
     * @param {unknown} reason
     */
    terminate(reason: unknown): void;
    /**
     * Asks the worker to do one of its things. A bitmap or pixels that are asked about go over to it.
     *
     * @template {keyof Host & string} Method
     * @param {Method} method
     * @param {Parameters<Host[Method]>[0]} request
     * @returns {Promise<Awaited<ReturnType<Host[Method]>>>}
     */
    call<Method extends keyof Host & string>(method: Method, request: Parameters<Host[Method]>[0]): Promise<Awaited<ReturnType<Host[Method]>>>;
}
