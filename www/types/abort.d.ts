/**
 * What comes of work, or at once the reason of a signal.
 *
 * @template T
 * @param {Promise<T>} work
 * @param {AbortSignal | undefined} signal
 * @param {(late: T) => void} [letGo] takes what comes when nobody waits for it any more
 * @returns {Promise<T>}
 */
export declare function unlessAborted<T>(work: Promise<T>, signal: AbortSignal | undefined, letGo?: (late: T) => void): Promise<T>;
