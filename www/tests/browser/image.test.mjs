// Pictures from files, and the bundled clip.

import assert from "node:assert/strict";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { deflateSync } from "node:zlib";
import { after, before, test } from "node:test";

import { PHONE, SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";
import { collectEstimates, takeEstimates } from "../support/estimates.mjs";
import { disagreement } from "../support/maps.mjs";
import { nativeEstimates, unseenFrames } from "../support/native.mjs";
import { pngChunk } from "../support/png.mjs";

/** As for the camera, see there. */
const SAME = { maskPixels: 130, depthMm: 1, registrationMm: 0.5 };
/** Of the poster's small picture from its texture, levels of 255 (mean): 5.4. */
const MAX_APART = 8;

let folder;
let frames;
let browser;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-image-"));
    frames = await unseenFrames(folder, 2);
    browser = await launch();
  },
  { timeout: SLOW_MS },
);
after(async () => {
  await browser?.close();
  await rm(folder, { recursive: true, force: true });
});

test("an image file gives the maps that the native program gives", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu" });
  await collectEstimates(demo.page);
  for (const [i, { name, png }] of frames.entries()) {
    await demo.page.setInputFiles("#image-file", { name: `${name}.png`, mimeType: "image/png", buffer: png });
    const [estimate] = await takeEstimates(demo.page, 1, i);
    const native = (await nativeEstimates(join(folder, name), [{ name, png }], estimate.camera)).get(name);
    assert.equal(estimate.found, native.found);
    const apart = disagreement(estimate, native);
    for (const [figure, most] of Object.entries(SAME)) assert.ok(apart[figure] <= most, `${figure} ${apart[figure]}`);
  }
  await demo.screenshot("desktop-image");
  await demo.finish();
});

test("an image without the poster is shown with the words that it was not found", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { device: PHONE, query: "?device=cpu" });
  await demo.page.setInputFiles("#image-file", { name: "grey.png", mimeType: "image/png", buffer: greyPng(640, 480) });
  await demo.page.waitForSelector('#state[data-state="missing"]');
  assert.equal(await demo.page.textContent("#state-text"), "Poster not found");
  assert.ok(await demo.page.isVisible("#hint"));
  await demo.screenshot("phone-not-found");
  await demo.finish();
});

test("an empty file, a broken one and one that is no image are refused in words", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu" });
  const broken = Buffer.from(frames[0].png);
  broken.fill(0, 0, 64);
  for (const [name, buffer, detail] of [
    ["empty.png", Buffer.alloc(0), /empty/],
    ["broken.png", broken, /could not be read/],
    ["words.png", Buffer.from("hello"), /could not be read/],
  ]) {
    await demo.page.setInputFiles("#image-file", { name, mimeType: "image/png", buffer });
    const message = await messageOf(demo.page);
    assert.equal(message.code, "image-unreadable");
    assert.match(message.detail, detail);
    await demo.screenshot("desktop-image-unreadable");
    await demo.page.click("#message-close");
  }
  await demo.finish();
});

test(
  "an image of 20,000 x 20,000 pixels is answered or refused, and the page lives on",
  { timeout: SLOW_MS },
  async () => {
    const demo = await openDemo(browser, { query: "?device=cpu", expectedErrors: [/decod/i] });
    await demo.page.setInputFiles("#image-file", {
      name: "huge.png",
      mimeType: "image/png",
      buffer: greyPng(20_000, 20_000),
    });
    await demo.page.waitForSelector('#state[data-state="missing"], #message[open]');
    if (await demo.page.isVisible("#message")) {
      assert.equal((await messageOf(demo.page)).code, "image-unreadable");
    } else {
      const [width, height] = (await demo.page.textContent("#frame-size")).split(" × ").map(Number);
      assert.ok(width * height <= 4096 * 4096, `${width} x ${height}`);
    }
    await demo.page.setInputFiles("#image-file", { name: "next.png", mimeType: "image/png", buffer: frames[0].png });
    await demo.page.waitForFunction(() => document.querySelector("#frame-size").textContent === "480 × 270");
    await demo.finish();
  },
);

test("the poster is found in the bundled clip by a small picture of it", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu" });
  const apart = await demo.page.evaluate(async () => {
    const read = async (address) => {
      const bitmap = await createImageBitmap(await (await fetch(address)).blob(), { resizeWidth: 297, resizeHeight: 210, resizeQuality: "high" });
      const context = new OffscreenCanvas(297, 210).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, 297, 210).data;
    };
    const [small, whole] = await Promise.all(["/demo/poster.webp", "/models/poster-a4/template/texture.png"].map(read));
    return small.reduce((sum, value, i) => sum + Math.abs(value - whole[i]), 0) / small.length;
  });
  assert.ok(apart < MAX_APART, `${apart} levels from the poster`);
  await demo.page.click("#use-clip");
  await demo.page.waitForSelector('#state[data-state="found"]');
  assert.equal(await demo.page.textContent("#source-label"), "Clip, synthetic");
  assert.match(await demo.page.textContent("#focal-source"), /given/);
  await demo.screenshot("desktop-clip");
  await demo.finish();
});

/** A grey picture as a PNG, streamed by hand so that also a huge one takes little memory. */
function greyPng(width, height) {
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  // One bit a pixel, grey, all white but for the filter bytes.
  header.set([1, 0, 0, 0, 0], 8);
  const row = Buffer.alloc(1 + Math.ceil(width / 8), 0xff);
  row[0] = 0;
  const rows = deflateSync(Buffer.concat(Array.from({ length: height }, () => row)));
  return Buffer.concat([
    Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]),
    pngChunk("IHDR", header),
    pngChunk("IDAT", rows),
    pngChunk("IEND", Buffer.alloc(0)),
  ]);
}
