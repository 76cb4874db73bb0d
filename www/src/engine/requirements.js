// What the engine cannot do without in a browser. Everything else is asked for where it is used, and done without.

import { DeepSftError } from "../error.js";

/** A WebAssembly module with one function of 128-bit vectors. */
// prettier-ignore
const VECTORS = Uint8Array.of(
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
);

/** By name, whether it is there. @type {Readonly<Record<string, () => boolean>>} */
const NEEDED = {
  WebAssembly: () => typeof WebAssembly === "object",
  "WebAssembly vectors (SIMD)": () => WebAssembly.validate(VECTORS),
  "web workers that are modules": areWorkersModules,
  createImageBitmap: () => typeof createImageBitmap === "function",
  OffscreenCanvas: () => typeof OffscreenCanvas === "function",
};

const NO_ADDRESS = "https://:";

/** Whether the browser asks of what type a worker is. None starts: the address is no address. */
function areWorkersModules() {
  // Newer than module workers in every browser; with them the question below may be a violation of the page's policy.
  if ("trustedTypes" in globalThis) return true;
  let asked = false;
  const options = {
    /** @returns {"module"} */
    get type() {
      asked = true;
      return "module";
    },
  };
  try {
    // Written as an address in the call, Parcel would look for its file.
    new Worker(NO_ADDRESS, options).terminate();
  } catch {
    // It always gets here, even without workers.
  }
  return asked;
}

/**
 * Refuses a browser that the engine cannot run in, before anything is fetched.
 *
 * @throws {DeepSftError} `browser-unsupported`
 */
export function requireBrowser() {
  for (const [name, isThere] of Object.entries(NEEDED)) {
    if (isThere()) continue;
    throw new DeepSftError("browser-unsupported", `This browser has no ${name}, which the engine needs; a newer one has it.`);
  }
}
