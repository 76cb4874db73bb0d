// Signals on work that goes on to its end by itself.

/**
 * What comes of work, or at once the reason of a signal.
 *
 * @template T
 * @param {Promise<T>} work
 * @param {AbortSignal | undefined} signal
 * @param {(late: T) => void} [letGo] takes what comes when nobody waits for it any more
 * @returns {Promise<T>}
 */
export async function unlessAborted(work, signal, letGo) {
  const waiting = new AbortController();
  const aborted = new Promise((_, reject) => {
    if (signal?.aborted) reject(signal.reason);
    signal?.addEventListener("abort", () => reject(signal.reason), { signal: waiting.signal });
  });
  try {
    return await Promise.race([work, aborted]);
  } catch (error) {
    work.then(letGo, () => undefined);
    throw error;
  } finally {
    waiting.abort();
  }
}
