// A page with nothing on it but the package, for tests of the package itself.

import { BLANK, contextOf, launch } from "./browser.mjs";
import { serve } from "../../serve.mjs";

export { BLANK };

/**
 * Opens an empty page of the site, with what tests share in its global scope: `deepsft` (the
 * package), `codeOf` (a promise's error code), `poster` (a canvas that shows the template of an estimator).
 *
 * @param {object} [options]
 * @param {(page: import("playwright-core").Page) => Promise<void>} [options.prepare] before the page is loaded
 * @param {string[]} [options.permissions]
 * @param {Record<string, string>} [options.headers] of what the site answers
 * @param {(body: { page: import("playwright-core").Page, origin: string }) => Promise<void>} body
 */
export async function onPage({ prepare, permissions = [], headers, ...launchOptions } = {}, body) {
  const server = await serve({ headers });
  const browser = await launch(launchOptions);
  let page;
  try {
    const context = await contextOf(browser, {});
    if (permissions.length > 0) await context.grantPermissions(permissions, { origin: server.origin });
    page = await context.newPage();
    await prepare?.(page);
    // A real file: browsers forbid pages that a test makes up to ask other servers of this machine.
    await page.goto(server.origin + BLANK);
    await page.evaluate(async () => {
      const deepsft = await import("/src/index.js");
      const codeOf = (promise) =>
        Promise.resolve(promise).then(
          (value) => `resolved to ${value}`,
          (error) => (error instanceof deepsft.DeepSftError ? error.code : String(error)),
        );
      const poster = (sft) => {
        const [{ texture }] = sft.targets;
        const picture = new OffscreenCanvas(texture.width, texture.height);
        picture.getContext("2d").putImageData(texture, 0, 0);
        const canvas = new OffscreenCanvas(640, 360);
        const context = canvas.getContext("2d");
        context.fillStyle = "#777";
        context.fillRect(0, 0, 640, 360);
        const height = (300 * texture.height) / texture.width;
        context.drawImage(picture, 170, (360 - height) / 2, 300, height);
        return canvas;
      };
      Object.assign(globalThis, { deepsft, codeOf, poster });
    });
    await body({ page, origin: server.origin, browser, context });
  } finally {
    await page?.close();
    await browser.close();
    await server.close();
  }
}

/**
 * Adds to the beginning of the engine's worker.
 *
 * @param {string} script
 */
export const inWorker = (script) => (page) =>
  page.route("**/src/worker.js", async (route) => {
    const response = await route.fetch();
    // Imports are hoisted: what is to run before them has to be imported before them.
    const address = `data:text/javascript,${encodeURIComponent(script)}`;
    await route.fulfill({ response, body: `import ${JSON.stringify(address)};\n${await response.text()}` });
  });

/** For {@link inWorker}: the emulated adapter looks like a real one, and the worker's devices are kept, for {@link loseGpu}. */
export const REAL_GPU = `
  const INFO = { vendor: "test", architecture: "real", device: "", description: "", isFallbackAdapter: false };
  Object.defineProperty(GPUAdapter.prototype, "info", { get: () => INFO });
  self.devices = [];
  const { requestDevice } = GPUAdapter.prototype;
  GPUAdapter.prototype.requestDevice = async function (...options) {
    const device = await requestDevice.apply(this, options);
    self.devices.push(device);
    return device;
  };
`;

/** Takes the workers' devices away. @param {import("playwright-core").Page} page */
export async function loseGpu(page) {
  for (const worker of page.workers()) {
    if ((await worker.evaluate(() => self.devices?.splice(0).map((device) => device.destroy()).length)) > 0) return;
  }
  throw new Error("no worker has a device");
}

/** For {@link inWorker}: keeps the memory of the worker's WebAssembly as `wasmMemory`. */
export const KEEP_MEMORY = `
  const { instantiate } = WebAssembly;
  WebAssembly.instantiate = async (...given) => {
    const made = await instantiate(...given);
    self.wasmMemory = made.exports.memory;
    return made;
  };
`;

/** Bytes of the WebAssembly memory of each worker that keeps it. @param {import("playwright-core").Page} page */
export const wasmBytes = (page) =>
  Promise.all(page.workers().map((worker) => worker.evaluate(() => self.wasmMemory.buffer.byteLength)));
