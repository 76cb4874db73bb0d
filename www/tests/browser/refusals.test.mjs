// Everything that can be in the way, in a real browser, and what the page says then.

import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, PHONE, SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";
import { y4m } from "../support/y4m.mjs";
import { MODEL } from "../support/native.mjs";

/** A picture of one pixel. */
const DOT_PNG = Buffer.from(
  "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg==",
  "base64",
);

let folder;
let cameraFile;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-refusals-"));
  cameraFile = join(folder, "grey.y4m");
  await writeFile(cameraFile, y4m([{ width: 64, height: 48, rgb: new Uint8Array(3 * 64 * 48).fill(120) }], 30));
});
after(() => rm(folder, { recursive: true, force: true }));

/** Runs `body` on the page in a browser of its own. */
async function withDemo(launchOptions, demoOptions, body) {
  const browser = await launch(launchOptions);
  try {
    const demo = await openDemo(browser, demoOptions);
    await body(demo);
    await demo.finish();
  } finally {
    await browser.close();
  }
}

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`a camera that is not allowed is named, with a way on, on a ${name}`, { timeout: SLOW_MS }, () =>
    withDemo(
      { camera: cameraFile },
      { device, query: "?device=cpu", permissions: [] },
      async ({ page, screenshot }) => {
        await page.click("#use-camera");
        const { code, title } = await messageOf(page);
        assert.equal(code, "camera-denied");
        assert.equal(title, "The camera was not allowed");
        assert.deepEqual(await page.locator("#message-remedies button").allTextContents(), [
          "Try again",
          "Use the clip",
          "Open an image",
        ]);
        await screenshot(`${name}-camera-denied`);
        await page.click("#message-close");
        assert.ok(await page.isVisible("#use-camera"));
        await screenshot(`${name}-start`);
      },
    ),
  );
}

test("a machine without a camera is told so", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: PHONE, query: "?device=cpu", permissions: ["camera"] }, async ({ page, screenshot }) => {
    await page.click("#use-camera");
    assert.equal((await messageOf(page)).code, "camera-not-found");
    await screenshot("phone-camera-not-found");
  }),
);

test(
  "a camera that goes away in mid-stream ends the view with its reason, and can be tried again",
  { timeout: SLOW_MS },
  () =>
    withDemo(
      { camera: cameraFile },
      { query: "?device=cpu", permissions: ["camera"] },
      async ({ page, context, origin, screenshot }) => {
        await page.click("#use-camera");
        await page.waitForSelector('#state[data-state="missing"]');
        // Withdrawing the permission ends the track as unplugging does.
        await context.clearPermissions();
        assert.equal((await messageOf(page)).code, "camera-lost");
        await screenshot("desktop-camera-lost");
        await context.grantPermissions(["camera"], { origin });
        await page.click("#message-remedies button >> text=Try again");
        await page.waitForSelector('#state[data-state="missing"]');
      },
    ),
);

test("without WebGPU the CPU does the work and the page says why", { timeout: SLOW_MS }, () =>
  withDemo({ webgpu: false, camera: cameraFile }, { permissions: ["camera"] }, async ({ page, screenshot }) => {
    await page.click("#use-camera");
    await page.waitForSelector('#state[data-state="missing"]');
    assert.equal(await page.textContent("#device"), "CPU");
    assert.match(await page.textContent("#fallback"), /WebGPU/);
    assert.match(await page.textContent("#notice-text"), /^Running on the CPU\. /);
    await screenshot("desktop-no-webgpu");
    // In a window in which the figures lie where the notice does.
    await page.setViewportSize({ width: 840, height: 580 });
    await page.click("#notice-close");
    assert.equal(await page.isVisible("#notice"), false);
  }),
);

test("an adapter that is only emulated is passed over, and the page says so", { timeout: SLOW_MS }, () =>
  withDemo({ camera: cameraFile }, { device: PHONE, permissions: ["camera"] }, async ({ page, screenshot }) => {
    await page.click("#use-camera");
    await page.waitForSelector('#state[data-state="missing"]');
    assert.match(await page.textContent("#fallback"), /emulated in software/);
    await screenshot("phone-software-webgpu");
  }),
);

test("WebGPU asked for by name and not there is an error, not a fallback", { timeout: SLOW_MS }, () =>
  withDemo(
    { webgpu: false, camera: cameraFile },
    { query: "?device=webgpu", permissions: ["camera"] },
    async ({ page, screenshot }) => {
      await page.click("#use-camera");
      assert.equal((await messageOf(page)).code, "webgpu-unavailable");
      await screenshot("desktop-webgpu-unavailable");
    },
  ),
);

/** Serves a file of the model changed by `change`. */
const changed = (file, change) => (context) =>
  context.route(`**/models/poster-a4/${file}`, async (route) => {
    const body = change(await readFile(join(MODEL, file)));
    await (body === null ? route.fulfill({ status: 404, body: "" }) : route.fulfill({ status: 200, body }));
  });

for (const [what, file, change, code] of [
  ["one flipped bit in the weights", "weights.bpk", (bytes) => flipped(bytes, bytes.length >> 1), "model-corrupt"],
  ["weights that were cut short", "weights.bpk", (bytes) => bytes.subarray(0, bytes.length >> 1), "model-corrupt"],
  ["weights that are missing", "weights.bpk", () => null, "model-load"],
  ["a description that is not JSON", "model.json", (bytes) => bytes.subarray(0, 40), "model-corrupt"],
  [
    "a model of a newer version",
    "model.json",
    (bytes) => JSON.stringify({ ...JSON.parse(bytes), format_version: 99 }),
    "model-version",
  ],
  [
    "a model that asks for a file elsewhere",
    "model.json",
    (bytes) => withFile(bytes, "https://example.com/weights.bpk"),
    "model-corrupt",
  ],
  [
    "a model that asks for a file above its folder",
    "model.json",
    (bytes) => withFile(bytes, "../secret"),
    "model-corrupt",
  ],
]) {
  test(`${what}: ${code}`, { timeout: SLOW_MS }, () =>
    withDemo(
      {},
      { query: "?device=cpu", prepare: changed(file, change), expectedErrors: [/404/] },
      async ({ page, screenshot }) => {
        await page.setInputFiles("#image-file", { name: "dot.png", mimeType: "image/png", buffer: DOT_PNG });
        assert.equal((await messageOf(page)).code, code);
        await screenshot(`desktop-${what.replaceAll(" ", "-")}`);
      },
    ),
  );
}

test("a lost GPU is started again twice, unseen, and then reported", { timeout: SLOW_MS }, async () => {
  /** Keeps the devices that the worker opens, so that the test can take them away. */
  const hook = `
    self.devices = [];
    const { requestDevice } = GPUAdapter.prototype;
    GPUAdapter.prototype.requestDevice = async function (...options) {
      const device = await requestDevice.apply(this, options);
      self.devices.push(device);
      return device;
    };
  `;
  const prepare = (context) =>
    context.route("**/src/worker.js", async (route) => {
      const response = await route.fetch();
      await route.fulfill({ response, body: `${await response.text()}\n${hook}` });
    });
  await withDemo(
    { camera: cameraFile },
    { query: "?device=webgpu", permissions: ["camera"], prepare, expectedErrors: [/./] },
    async ({ page, screenshot }) => {
      // The tracker has a worker too, without a device.
      const loseDevice = async () => {
        for (const worker of page.workers()) {
          const lost = await worker.evaluate(() => self.devices.map((device) => device.destroy()).length);
          if (lost > 0) return worker;
        }
        throw new Error("no worker has a device");
      };
      await page.evaluate(() => {
        globalThis.count = 0;
        document.addEventListener("deepsft-estimate", () => globalThis.count++);
      });
      const frames = (more) =>
        page.waitForFunction(
          (wanted) => globalThis.count >= wanted || document.querySelector("#message").open,
          more,
        );
      await page.click("#use-camera");
      await frames(1);
      for (let loss = 0; loss < 2; loss++) {
        const lost = await loseDevice();
        const before = await page.evaluate(() => globalThis.count);
        await frames(before + 2);
        assert.equal(await page.isVisible("#message"), false, `loss ${loss} is not shown`);
        assert.ok(!page.workers().includes(lost), "the engine runs in a new worker");
      }
      await loseDevice();
      assert.equal((await messageOf(page)).code, "gpu-lost");
      await screenshot("desktop-gpu-lost");
    },
  );
});

function flipped(bytes, at) {
  const copy = Buffer.from(bytes);
  copy[at] ^= 1;
  return copy;
}

function withFile(bytes, name) {
  const manifest = JSON.parse(bytes);
  manifest.files[name] = { size: 1, sha256: "0".repeat(64) };
  return JSON.stringify(manifest);
}
