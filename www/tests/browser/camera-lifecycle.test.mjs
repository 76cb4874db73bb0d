// A phone call, a locked screen, another tab: what becomes of a camera, and of the page that shows it. The camera, its tracks
// and the page are real; a browser under test has no phone, so the events that a phone brings are sent by hand.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { y4m } from "../support/y4m.mjs";

let folder;
let camera;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-lifecycle-"));
  camera = join(folder, "grey.y4m");
  const grey = (value) => ({ width: 64, height: 48, rgb: new Uint8Array(3 * 64 * 48).fill(value) });
  await writeFile(camera, y4m([grey(120), grey(125)], 30));
});
after(() => rm(folder, { recursive: true, force: true }));

/** Runs `body` on the demo page while its camera plays. */
async function withCamera(body) {
  const browser = await launch({ webgpu: false, camera });
  try {
    const demo = await openDemo(browser, { query: "?device=cpu", permissions: ["camera"] });
    const { page } = demo;
    await page.evaluate(() => {
      globalThis.frames = 0;
      document.addEventListener("deepsft-tracked", () => globalThis.frames++);
      globalThis.video = document.querySelector("#video");
      globalThis.setAway = (away) => {
        Object.defineProperty(document, "visibilityState", { value: away ? "hidden" : "visible", configurable: true });
        document.dispatchEvent(new Event("visibilitychange"));
      };
    });
    await page.click("#use-camera");
    await page.waitForSelector('#state[data-state="missing"]');
    const playsOn = async () => {
      const before = await page.evaluate(() => globalThis.frames);
      await page.waitForFunction((count) => globalThis.frames > count + 3, before, { timeout: SLOW_MS });
    };
    await playsOn();
    await body({ page, playsOn, screenshot: demo.screenshot });
    await demo.finish();
  } finally {
    await browser.close();
  }
}

test("a video that the browser paused while the page was away plays on when it returns", { timeout: SLOW_MS }, () =>
  withCamera(async ({ page, playsOn }) => {
    for (const back of ["visibilitychange", "pageshow"]) {
      await page.evaluate(() => (setAway(true), video.pause()));
      await page.evaluate(
        (event) =>
          event === "pageshow"
            ? dispatchEvent(new PageTransitionEvent((delete document.visibilityState, event), { persisted: true }))
            : setAway(false),
        back,
      );
      await playsOn();
    }
  }),
);

test("a camera that is muted is said to be interrupted until it is unmuted", { timeout: SLOW_MS }, () =>
  withCamera(async ({ page, playsOn, screenshot }) => {
    await page.evaluate(() => {
      const [track] = video.srcObject.getVideoTracks();
      track.dispatchEvent(new Event("mute"));
      video.pause();
    });
    await page.waitForFunction(() => !document.querySelector("#loading").hidden);
    assert.equal(await page.textContent("#loading-text"), "The camera is interrupted");
    await screenshot("desktop-camera-interrupted");
    await page.evaluate(() => video.srcObject.getVideoTracks()[0].dispatchEvent(new Event("unmute")));
    await playsOn();
    await page.waitForSelector("#loading", { state: "hidden" });
  }),
);

test("a camera that is taken away while the page is away is opened again", { timeout: SLOW_MS }, () =>
  withCamera(async ({ page, playsOn }) => {
    const first = await page.evaluate(() => {
      setAway(true);
      const [track] = video.srcObject.getVideoTracks();
      track.stop();
      track.dispatchEvent(new Event("ended"));
      return track.id;
    });
    assert.equal(await page.isVisible("#message"), false);
    await page.evaluate(() => setAway(false));
    await playsOn();
    assert.notEqual(await page.evaluate(() => video.srcObject.getVideoTracks()[0].id), first);
    await page.waitForSelector("#loading", { state: "hidden" });
  }),
);

test("the clip plays on too", { timeout: SLOW_MS }, async () => {
  const browser = await launch({ webgpu: false });
  try {
    const demo = await openDemo(browser, { query: "?device=cpu" });
    const { page } = demo;
    await page.click("#use-clip");
    await page.waitForFunction(() => document.querySelector("#video").readyState > 1);
    await page.evaluate(() => {
      document.querySelector("#video").pause();
      dispatchEvent(new Event("pageshow"));
    });
    await page.waitForFunction(() => !document.querySelector("#video").paused);
    await demo.finish();
  } finally {
    await browser.close();
  }
});
