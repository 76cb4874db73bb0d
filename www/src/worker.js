// The module worker that does the computing, so that no frame ever blocks the page. It plays one of two parts: the
// engine, or the tracker of one video.

import { addTarget, estimate, exifFocal, find, flatten, mesh, readScan, removeTarget, start } from "./engine/engine-host.js";
import { DeepSftError, asDeepSftError } from "./error.js";
import { answer, follow, startTracker, trackTarget, trackedMaps, untrackTarget } from "./tracking/tracker-host.js";
import { COPY_AGAIN, VERSION } from "./version.js";

/** @type {Readonly<Record<string, (request: any) => unknown>>} */
const METHODS = {
  ...{ start, addTarget, removeTarget, exifFocal, readScan, estimate, find, flatten, mesh },
  ...{ startTracker, trackTarget, untrackTarget, follow, answer, trackedMaps },
};

/** Whether the module has trapped outside of the calls below: its promises are rejected, and nothing of it works any more. */
let isBroken = false;
self.addEventListener("error", () => void (isBroken = true));

/**
 * @param {unknown} error
 * @returns {DeepSftError}
 */
function explained(error) {
  if (!(error instanceof WebAssembly.RuntimeError)) return asDeepSftError(error);
  return new DeepSftError("internal", `The engine stopped because of a defect (${error.message}).`);
}

self.addEventListener("message", async ({ data: { id, method, request, version } }) => {
  try {
    if (version !== VERSION) throw new DeepSftError("engine-load", `The page runs deepsft ${version}, its worker is of ${VERSION}. ${COPY_AGAIN}`);
    const { value, transfer } = /** @type {{ value: unknown, transfer: Transferable[] }} */ (
      await METHODS[method](request)
    );
    self.postMessage({ id, value }, { transfer });
  } catch (error) {
    const { code, message } = explained(error);
    self.postMessage({ id, error: { code, message }, fatal: isBroken || error instanceof WebAssembly.RuntimeError });
  }
});
