// The module worker that does the computing, so that no frame ever blocks the page. It plays one of two parts: the
// engine, or the tracker of one video.

import * as engine from "./engine/engine-host.js";
import { DeepSftError, asDeepSftError } from "./error.js";
import * as tracker from "./tracking/tracker-host.js";
import { COPY_AGAIN, VERSION } from "./version.js";

/** @type {Readonly<Record<string, (request: any) => unknown>>} */
const METHODS = { ...engine, ...tracker };

/** Whether the module has trapped outside of the calls below: its promises are rejected, and nothing of it works any more. */
let isBroken = false;
self.addEventListener("error", () => void (isBroken = true));

/** What of a value crosses without a copy. @param {unknown} value @returns {Iterable<Transferable>} */
function* transferables(value) {
  if (value instanceof ImageBitmap) yield value;
  else if (ArrayBuffer.isView(value)) yield /** @type {ArrayBuffer} */ (value.buffer);
  else if (value instanceof Object) for (const part of Object.values(value)) yield* transferables(part);
}

self.addEventListener("message", async ({ data: { id, method, request, version } }) => {
  try {
    if (version !== VERSION) throw new DeepSftError("engine-load", `The page runs deepsft ${version}, its worker is of ${VERSION}. ${COPY_AGAIN}`);
    const value = await METHODS[method](request);
    self.postMessage({ id, value }, { transfer: [...new Set(transferables(value))] });
  } catch (error) {
    const hasTrapped = error instanceof WebAssembly.RuntimeError;
    const { code, message } = hasTrapped ? new DeepSftError("internal", `The engine stopped because of a defect (${error.message}).`) : asDeepSftError(error);
    self.postMessage({ id, error: { code, message }, fatal: isBroken || hasTrapped });
  }
});
