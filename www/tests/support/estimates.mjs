// What the page computed, taken from the event it fires for each estimate.

import { SLOW_MS } from "./browser.mjs";

/** Starts collecting; call before the first estimate. @param {import("playwright-core").Page} page */
export async function collectEstimates(page) {
  await page.evaluate(() => {
    globalThis.estimates = [];
    document.addEventListener("deepsft-estimate", ({ estimate }) => {
      const { found, confidence, camera, times, frame } = estimate;
      const canvas = new OffscreenCanvas(frame.width, frame.height);
      canvas.getContext("2d").drawImage(frame, 0, 0);
      const maps = { depth: estimate.depth.toFloat32Array(), registration: estimate.registration.toFloat32Array() };
      globalThis.estimates.push({ found, confidence, camera, times, canvas, maps });
    });
  });
}

/**
 * The estimates from number `from` on, once there are `count` of them.
 *
 * @param {import("playwright-core").Page} page
 * @param {number} count
 * @param {number} [from]
 */
export async function takeEstimates(page, count, from = 0) {
  await page.waitForFunction(
    (wanted) => globalThis.estimates.length >= wanted || document.querySelector("#message").open,
    from + count,
    { timeout: SLOW_MS },
  );
  const taken = await page.evaluate(async (first) => {
    const base64 = (buffer) =>
      new Promise((resolve) => {
        const reader = new FileReader();
        reader.onload = () => resolve(reader.result.split(",")[1]);
        reader.readAsDataURL(new Blob([buffer]));
      });
    return Promise.all(
      globalThis.estimates.slice(first).map(async ({ found, confidence, camera, times, canvas, maps }) => {
        const png = await base64(await canvas.convertToBlob({ type: "image/png" }));
        return {
          found,
          confidence,
          camera,
          times,
          png,
          depth: await base64(maps.depth),
          registration: await base64(maps.registration),
        };
      }),
    );
  }, from);
  if (taken.length < count) throw new Error(`the page shows: ${await page.locator("#message").innerText()}`);
  const floats = (base64) => new Float32Array(new Uint8Array(Buffer.from(base64, "base64")).buffer);
  return taken.map(({ png, depth, registration, ...rest }) => ({
    ...rest,
    png: Buffer.from(png, "base64"),
    depth: floats(depth),
    registration: floats(registration),
  }));
}
