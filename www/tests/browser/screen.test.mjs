// The poster on a desktop's screen, and the code there that brings a phone to the page.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import jsqr from "jsqr";

import { violations } from "../support/axe.mjs";
import { PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { decodePng } from "../support/png.mjs";

let browser;
before(async () => (browser = await launch({ webgpu: false, testCameras: 1 })));
after(() => browser?.close());

/** What a phone reads in a picture. */
function read(png) {
  const { width, height, channels, values } = decodePng(png);
  const rgba = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let i = 0; i < width * height; i++) for (let k = 0; k < 3; k++) rgba[4 * i + k] = values[channels * i + k];
  return jsqr(rgba, width, height)?.data;
}

test("on a desktop the poster is on the screen at its size, and a phone that reads the code looks for it", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { device: { viewport: { width: 1500, height: 900 } } });
  const { page } = demo;
  const fetched = [];
  page.on("request", (request) => fetched.push(new URL(request.url()).pathname));
  await page.waitForTimeout(300);
  assert.deepEqual(fetched.filter((name) => /uqr|screen|texture/.test(name)), [], "before it is wanted");
  await page.click("#use-screen");
  await page.waitForFunction(() => document.querySelector("#screen-poster").naturalWidth && document.querySelector("#screen-code").naturalWidth);
  const { width, height } = await page.locator("#screen-poster").evaluate((poster) => poster.getBoundingClientRect().toJSON());
  const mm = 96 / 25.4;
  assert.deepEqual([width / mm, height / mm].map(Math.round), [297, 210]);
  assert.equal(await page.textContent("#screen-note"), "");
  assert.match(await page.textContent("#screen-address"), /--lan/);
  assert.deepEqual(await violations(page), []);
  await demo.screenshot("screen");
  const address = read(await page.screenshot());
  assert.equal(address, `${new URL(page.url()).origin}/#poster`);

  await page.setViewportSize({ width: 1000, height: 600 });
  await page.click("#screen button");
  await page.click("#use-screen");
  await page.waitForFunction(() => /^At \d\d % of its size/.test(document.querySelector("#screen-note").textContent));
  const box = await page.locator("#screen").boundingBox();
  assert.ok(box.x >= 0 && box.y >= 0 && box.x + box.width <= 1000 && box.y + box.height <= 600, JSON.stringify(box));
  await demo.screenshot("screen-small");
  await page.keyboard.press("Escape");
  assert.equal(await page.isVisible("#screen"), false);
  await page.close();

  const phone = await openDemo(browser, { device: PHONE });
  assert.equal(await phone.page.isVisible("#use-screen"), false);
  await phone.page.goto("about:blank");
  await phone.page.goto(address);
  await phone.page.waitForFunction(() => document.body.dataset.view === "live" && document.querySelector("#live").dataset.source === "camera");
  assert.equal(await phone.page.evaluate(() => location.hash), "");
  await phone.page.close();
});
