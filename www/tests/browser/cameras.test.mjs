// Several cameras: the button that changes between two, the list where there are more. The cameras are Chromium's own test cameras.

import assert from "node:assert/strict";
import { test } from "node:test";

import { violations } from "../support/axe.mjs";
import { DESKTOP, PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";

/** Opens the demo with so many cameras and runs `body` once the first of them shows. */
async function withCameras(testCameras, options, body) {
  const browser = await launch({ webgpu: false, testCameras });
  try {
    const demo = await openDemo(browser, { query: "?device=cpu", permissions: ["camera"], ...options });
    const { page } = demo;
    await page.evaluate(() => {
      globalThis.frames = 0;
      document.addEventListener("deepsft-tracked", () => globalThis.frames++);
    });
    const shows = (label) =>
      page.waitForFunction((wanted) => document.querySelector("#video").srcObject?.getVideoTracks()[0].label === wanted, label);
    const playsOn = async () => {
      const before = await page.evaluate(() => globalThis.frames);
      await page.waitForFunction((count) => globalThis.frames > count + 3, before);
    };
    await page.click("#use-camera");
    await shows("fake_device_0");
    await playsOn();
    await body({ ...demo, shows, playsOn });
    await demo.finish();
  } finally {
    await browser.close();
  }
}

test("one camera needs no button", { timeout: SLOW_MS }, () =>
  withCameras(1, {}, async ({ page }) => {
    assert.equal(await page.isVisible("#cameras"), false);
    assert.equal(await page.textContent("#source-label"), "fake_device_0");
  }),
);

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`a button changes between two cameras, by hand and by keyboard, on a ${name}`, { timeout: SLOW_MS }, () =>
    withCameras(2, { device }, async ({ page, shows, playsOn, screenshot }) => {
      const button = page.locator("#cameras button");
      assert.equal(await button.getAttribute("aria-label"), "fake_device_0. Change to: fake_device_1");
      assert.equal(await page.isVisible("#cameras select"), false);
      assert.deepEqual(await violations(page), []);
      await screenshot(`cameras-two-${name}`);
      await button.click();
      await shows("fake_device_1");
      await playsOn();
      assert.equal(await button.getAttribute("aria-label"), "fake_device_1. Change to: fake_device_0");
      assert.equal(await page.textContent("#cameras [role=status]"), "fake_device_1");
      await button.focus();
      await page.keyboard.press("Enter");
      await shows("fake_device_0");
      await playsOn();
      assert.equal(await page.evaluate(() => document.activeElement.closest("#cameras") !== null), true, "the focus stays");
    }),
  );
}

test("of three cameras one is chosen from a list, by keyboard, and is the first to open on the next visit", { timeout: SLOW_MS }, () =>
  withCameras(3, { device: PHONE }, async ({ page, shows, playsOn, screenshot }) => {
    const list = page.locator("#cameras select");
    assert.deepEqual(await list.locator("option").allTextContents(), ["fake_device_0", "fake_device_1", "fake_device_2"]);
    assert.equal(await page.isVisible("#cameras button"), false);
    assert.deepEqual(await violations(page), []);
    await screenshot("cameras-three-phone");
    await list.focus();
    await page.keyboard.press("ArrowDown");
    await shows("fake_device_1");
    await playsOn();
    await list.selectOption("fake_device_2");
    await shows("fake_device_2");
    await playsOn();
    assert.equal(await list.evaluate((select) => select.selectedOptions[0].text), "fake_device_2");
    assert.equal(await page.textContent("#source-label"), "fake_device_2");
    await page.click("#back");
    assert.equal(await page.evaluate(() => document.querySelector("#video").srcObject), null);
    await page.reload();
    await page.click("#use-camera");
    await shows("fake_device_2");
  }),
);

test("a camera that does not open is said so, and the former one goes on", { timeout: SLOW_MS }, () =>
  withCameras(2, {}, async ({ page, shows, playsOn, screenshot }) => {
    await page.evaluate(() => {
      const devices = navigator.mediaDevices;
      const open = devices.getUserMedia.bind(devices);
      const { deviceId: kept } = document.querySelector("#video").srcObject.getVideoTracks()[0].getSettings();
      devices.getUserMedia = (wanted) =>
        wanted.video.deviceId?.exact === kept ? open(wanted) : Promise.reject(new DOMException("", "NotReadableError"));
    });
    await page.click("#cameras button");
    await page.waitForSelector("#notice:not([hidden])");
    assert.match(await page.textContent("#notice-text"), /^fake_device_1 does not open\. The camera is in use by another program/);
    await shows("fake_device_0");
    await playsOn();
    await screenshot("desktop-camera-refused");
    assert.equal(await page.evaluate(() => localStorage.getItem("deepsft/camera")), null);
  }),
);
