// A page that is really hidden, by another tab in front: it does nothing then, and goes on when it is back; the screen stays on only while
// it is seen.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { isDeepStrictEqual } from "node:util";

import { SLOW_MS, launchWithTabs } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { y4m } from "../support/y4m.mjs";
import { serve } from "../../serve.mjs";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_032;
/** So long the page does nothing while it is away, milliseconds, and so often what was under way when it left may last that long. */
const AWAY_MS = 3000;
const UNDER_WAY = 10;

let folder;
let camera;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-away-"));
  const { frames } = await makeClip({ event: "still", frames: 1, seed: SEED });
  camera = join(folder, "camera.y4m");
  await writeFile(camera, y4m([frames[0].picture, frames[0].picture], 30));
}, { timeout: SLOW_MS });
after(() => rm(folder, { recursive: true, force: true }));

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

test("while another tab is in front nothing is tracked, found or drawn; back again, tracking goes on", { timeout: SLOW_MS }, async (t) => {
  const server = await serve();
  const browser = await launchWithTabs({ webgpu: false, camera });
  try {
    const page = await browser.newPage();
    page.setDefaultTimeout(SLOW_MS);
    await page.evaluateOnNewDocument(() => {
      globalThis.done = { calls: 0, frames: 0, estimates: 0, screens: 0 };
      globalThis.locks = [];
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (...given) {
        done.calls++;
        return postMessage.apply(this, given);
      };
      document.addEventListener("deepsft-tracked", ({ tracked }) => (done.frames++, (globalThis.found = tracked.found)));
      document.addEventListener("deepsft-estimate", () => done.estimates++);
      const count = () => requestAnimationFrame(() => (done.screens++, count()));
      count();
      const { request } = WakeLock.prototype;
      WakeLock.prototype.request = async function (...given) {
        const lock = await request.apply(this, given);
        locks.push(lock);
        return lock;
      };
    });
    await page.goto(`${server.origin}/?device=cpu`);
    await page.click("#use-camera");
    await page.waitForFunction(() => globalThis.found);
    const held = () => page.evaluate(() => locks.map(({ released }) => !released));
    assert.deepEqual(await held(), [true], "the screen stays on");
    const other = await browser.newPage();
    await other.bringToFront();
    await page.waitForFunction(() => document.visibilityState === "hidden", { polling: 100 });
    const counts = () => page.evaluate(() => ({ ...done }));
    let [before, now] = [null, await counts()];
    for (let i = 0; i < UNDER_WAY && !isDeepStrictEqual(before, now); i++) {
      before = now;
      await pause(AWAY_MS);
      now = await counts();
    }
    assert.deepEqual(now, before);
    assert.deepEqual(await held(), [false]);
    await page.evaluate(() => (globalThis.found = false));
    const back = performance.now();
    await page.bringToFront();
    await page.waitForFunction(() => globalThis.found);
    t.diagnostic(`found again ${(performance.now() - back).toFixed(0)} ms after the page was back`);
    assert.deepEqual(await held(), [false, true], "the screen stays on again");
    await page.click("#back");
    await page.waitForFunction(() => locks.every(({ released }) => released));
  } finally {
    await browser.close();
    await server.close();
  }
});
