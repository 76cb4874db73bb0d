import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { requireBrowser } from "../../src/engine/requirements.js";

/** As a browser has it that knows workers of both types: it reads what is asked for, then refuses the address. */
class Worker {
  constructor(address, { type }) {
    throw new SyntaxError(`${address} as a worker of type ${type}`);
  }
}

/** What Node.js has not, as a browser has it. */
const BROWSER = { Worker, createImageBitmap() {}, OffscreenCanvas: class {} };
const { validate } = WebAssembly;

beforeEach(() => Object.assign(globalThis, BROWSER));
afterEach(() => {
  for (const name of Object.keys(BROWSER)) delete globalThis[name];
  WebAssembly.validate = validate;
});

test("a browser that has everything is not refused", () => {
  assert.doesNotThrow(requireBrowser);
});

test("what is missing is named", () => {
  for (const name of Object.keys(BROWSER)) {
    Object.assign(globalThis, BROWSER);
    delete globalThis[name];
    assert.throws(requireBrowser, { code: "browser-unsupported", message: new RegExp(name === "Worker" ? "workers" : name) });
  }
});

test("workers that are no modules do not do", () => {
  globalThis.Worker = class {
    terminate() {}
  };
  assert.throws(requireBrowser, { code: "browser-unsupported", message: /workers that are modules/ });
});

test("WebAssembly without vectors does not do", () => {
  WebAssembly.validate = () => false;
  assert.throws(requireBrowser, { code: "browser-unsupported", message: /SIMD/ });
});
