// A camera that nobody knows: the page finds its focal length while a person moves the sheet.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { cut } from "../support/pictures.mjs";
import { y4m } from "../support/y4m.mjs";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_041;
const FRAMES = 90;
const FRAMES_PER_SECOND = 12;
/** The middle of the clip's frames: the same camera with a smaller image, so that the page's guess is 0.83 of its focal length. */
const SIZE = { width: 800, height: 450 };
/** Of the true focal length. */
const MAX_ERROR = 0.03;

let folder;
let focal;
let cameraFile;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-self-calibration-"));
  const clip = await makeClip({ event: "motion", frames: FRAMES, seed: SEED, scale: 2 });
  focal = clip.camera.fx;
  cameraFile = join(folder, "camera.y4m");
  await writeFile(cameraFile, y4m(clip.frames.map(({ picture }) => cut(picture, SIZE)), FRAMES_PER_SECOND));
}, { timeout: SLOW_MS });
after(() => rm(folder, { recursive: true, force: true }));

test("the page finds the focal length of a camera from the moving sheet, says how sure it is, keeps it, and forgets it when told to", { timeout: SLOW_MS }, async (t) => {
  const browser = await launch({ camera: cameraFile });
  try {
    const demo = await openDemo(browser, { device: DESKTOP, query: "?device=cpu", permissions: ["camera"] });
    const { page } = demo;
    const cameras = async () => {
      await page.evaluate(() => {
        globalThis.cameras = [];
        document.addEventListener("deepsft-tracked", ({ tracked: { camera } }) => cameras.push(camera));
      });
      await page.click("#use-camera");
    };
    await cameras();
    await page.waitForFunction(() => cameras.some(({ source }) => source === "calibrated"));
    const [first, last] = await page.evaluate(() => [cameras[0], cameras.at(-1)]);
    t.diagnostic(`true ${focal}, assumed ${first.fx}, found ${last.fx} of ${last.width} x ${last.height}`);
    assert.deepEqual([first.source, first.width, first.height], ["estimated", SIZE.width, SIZE.height]);
    assert.ok(Math.abs(first.fx / focal - 1) > 0.15, "the guess is far off");
    assert.ok(Math.abs(last.fx / focal - 1) < MAX_ERROR, `${last.fx} in place of ${focal}`);
    // The sheet is found again with it, and it is there on the next visit.
    await page.waitForSelector('#state[data-state="found"]');
    await demo.screenshot("self-calibration");
    const { fx, spread } = await page.evaluate(() => cameras.at(-1));
    assert.ok(spread > 0 && spread <= 0.015 * fx, `${spread} of ${fx} px`);
    await page.reload();
    await cameras();
    await page.waitForFunction(() => cameras.length > 0);
    const kept = await page.evaluate(() => cameras[0]);
    assert.equal(kept.source, "calibrated");
    // It may have become surer in between.
    assert.ok(kept.spread <= spread && Math.abs(kept.fx / focal - 1) < MAX_ERROR, `${kept.fx} ± ${kept.spread} px`);
    await page.waitForFunction(() => /found here, ±\s\d\.\d\s%/.test(document.querySelector("#focal-source").textContent));
    await page.click("#forget");
    await page.waitForFunction(() => cameras.at(-1).source === "estimated");
    assert.equal(await page.evaluate(() => Object.keys(localStorage).filter((key) => key.startsWith("deepsft/focal/")).length), 0);
    await page.waitForFunction(() => getComputedStyle(document.querySelector("#forget")).display === "none");
    await demo.finish();
  } finally {
    await browser.close();
  }
});
