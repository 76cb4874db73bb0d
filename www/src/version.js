/** Version of this package. A test compares it with package.json; the worker compares it with the page's and the engine's. */
export const VERSION = "0.1.0";

/** What helps where page, worker and engine are of different versions. */
export const COPY_AGAIN = "Copy the package's folder dist anew.";
