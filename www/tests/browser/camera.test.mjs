// A camera that shows synthetic frames nobody has seen, through getUserMedia, against the native program and the truth.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { collectEstimates, takeEstimates } from "../support/estimates.mjs";
import { disagreement, errorsOf, median } from "../support/maps.mjs";
import { nativeEstimates, unseenFrames } from "../support/native.mjs";
import { decodePng } from "../support/png.mjs";
import { y4m } from "../support/y4m.mjs";

const FRAMES = 6;
/** Each frame stays for a second, so that also a slow path sees several. */
const FRAMES_PER_SECOND = 1;

/**
 * The same pixels through the same network: wasm and native differ in the order of f32 sums, WebGPU also in fused
 * multiplications. After some 50 layers that leaves a relative 1e-3; the borders of the mask flip where its logit is
 * within that of zero.
 */
const SAME = { maskPixels: 130, depthMm: 1, registrationMm: 0.5 };

/** 4:2:0 video halves the resolution of colour, so errors may exceed those on the original frames, but not by much. */
const VIDEO_LOSS = 1.25;

let folder;
let frames;
let cameraFile;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-camera-"));
    frames = await unseenFrames(folder, FRAMES);
    cameraFile = join(folder, "camera.y4m");
    await writeFile(
      cameraFile,
      y4m(
        frames.map(({ picture }) => picture),
        FRAMES_PER_SECOND,
      ),
    );
  },
  { timeout: SLOW_MS },
);
after(() => rm(folder, { recursive: true, force: true }));

/** The frame that a picture from the page shows, and the mean difference of their colours in grey levels. */
function shownFrame(png) {
  const { values, channels } = decodePng(png);
  const distances = frames.map(({ picture: { rgb } }) => {
    let sum = 0;
    for (let pixel = 0; pixel < rgb.length / 3; pixel += 7)
      for (let k = 0; k < 3; k++) sum += Math.abs(values[channels * pixel + k] - rgb[3 * pixel + k]);
    return sum / (3 * Math.ceil(rgb.length / 3 / 7));
  });
  const distance = Math.min(...distances);
  return { frame: frames[distances.indexOf(distance)], distance };
}

/** One estimate of each frame that was shown. */
function distinct(estimates) {
  const seen = new Map();
  for (const estimate of estimates) {
    const { frame, distance } = shownFrame(estimate.png);
    // Neighbouring frames differ by tens of grey levels; video and its colours by a few.
    assert.ok(distance < 8, `the camera's picture is ${distance} grey levels from any frame`);
    seen.set(frame.name, { frame, estimate });
  }
  return [...seen.values()];
}

for (const { device, wanted, different } of [
  { device: "cpu", wanted: 6, different: 4 },
  { device: "webgpu", wanted: 3, different: 2 },
]) {
  test(
    `on ${device} the page registers and measures the poster in a camera's stream as the native program does`,
    { timeout: 2 * SLOW_MS },
    async () => {
      const browser = await launch({ camera: cameraFile });
      try {
        // A small page: on this machine the processor draws it too.
        const size = { viewport: { width: 480, height: 400 } };
        const demo = await openDemo(browser, { device: size, query: `?device=${device}`, permissions: ["camera"] });
        await collectEstimates(demo.page);
        await demo.page.click("#use-camera");
        let estimates = [];
        while (estimates.length < wanted || distinct(estimates).length < different) {
          estimates = estimates.concat(await takeEstimates(demo.page, 1, estimates.length));
        }
        const shown = distinct(estimates);

        const { camera } = shown[0].estimate;
        assert.deepEqual([camera.width, camera.height, camera.source], [480, 270, "estimated"]);
        assert.ok(Math.abs(camera.fx - 0.79 * 480) < 1e-9);
        assert.equal(await demo.page.textContent("#device"), device === "cpu" ? "CPU" : "WebGPU (software)");

        const pictures = shown.map(({ frame, estimate }) => ({ name: frame.name, png: estimate.png }));
        const native = await nativeEstimates(join(folder, device), pictures, camera);
        for (const { frame, estimate } of shown) {
          const answer = native.get(frame.name);
          assert.equal(estimate.found, answer.found, `frame ${frame.name}`);
          assert.ok(Math.abs(estimate.confidence - answer.confidence) < 0.01);
          const apart = disagreement(estimate, answer);
          for (const [name, most] of Object.entries(SAME))
            assert.ok(apart[name] <= most, `frame ${frame.name}: ${name} ${apart[name]}`);
        }

        const errors = shown.map(({ frame, estimate }) => ({
          browser: errorsOf(estimate, frame.truth),
          native: frame.native,
        }));
        for (const name of ["depth_rmse_mm", "registration_rmse_mm"]) {
          const [inBrowser, bound] = [
            median(errors.map((e) => e.browser[name])),
            VIDEO_LOSS * median(errors.map((e) => e.native[name])),
          ];
          assert.ok(inBrowser <= bound, `${name}: ${inBrowser}, and deepsft eval allows ${bound}`);
        }
        const [overlap, bound] = [
          median(errors.map((e) => e.browser.mask_iou)),
          median(errors.map((e) => e.native.mask_iou)) - 0.02,
        ];
        assert.ok(overlap >= bound, `mask IoU: ${overlap}, and deepsft eval asks for ${bound}`);
        await demo.screenshot(`camera-${device}`);
        await demo.finish();
      } finally {
        await browser.close();
      }
    },
  );
}

for (const [name, size] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`every overlay can be chosen while the camera runs, on a ${name}`, { timeout: SLOW_MS }, async () => {
    const browser = await launch({ camera: cameraFile });
    try {
      const demo = await openDemo(browser, { device: size, query: "?device=cpu", permissions: ["camera"] });
      const { page } = demo;
      await page.click("#use-camera");
      await page.waitForSelector('#state[data-state="found"]');
      const overlayIs = (overlay) => page.waitForSelector(`[value="${overlay}"]:checked`);
      for (const paper of ["aurora", "ink", "squares"]) {
        await page.click(`[value="${paper}"]`);
        await page.waitForSelector(`[value="${paper}"]:checked`);
        await page.waitForSelector('#state[data-state="found"]');
        await demo.screenshot(`${name}-overlay-${paper}`);
      }
      for (const overlay of ["depth", "plain"]) {
        await page.click(`[value="${overlay}"]`);
        await overlayIs(overlay);
        assert.equal(await page.isVisible("#papers"), false);
        assert.equal(await page.isVisible("#scale"), overlay === "depth");
        await page.waitForSelector('#state[data-state="found"]');
        await demo.screenshot(`${name}-overlay-${overlay}`);
      }
      await page.click('[value="depth"]');
      // They come with the next frame.
      await page.waitForSelector("#scale-ticks span:nth-child(2)");
      const labels = (await page.locator("#scale-ticks span").allTextContents()).map(Number);
      assert.ok(
        labels.length >= 2 && labels.every((mm, i) => mm >= 100 && mm <= 2000 && (i === 0 || mm > labels[i - 1])),
        `${labels}`,
      );
      if (!(await page.isVisible("#hud"))) await page.click("#hud-toggle");
      for (const part of ["#capture-ms", "#warp-ms", "#track-ms", "#network-ms", "#judge-ms", "#draw-ms", "#fps"]) {
        assert.ok(Number(await page.textContent(part)) >= 0, part);
      }
      assert.match(await page.textContent("#model"), /[\d.]+ M parameters/);
      assert.match(await page.textContent("#focal"), /^f 379 px$/);
      assert.match(await page.textContent("#focal-source"), /estimated/);
      await demo.screenshot(`${name}-hud`);
      await demo.finish();
    } finally {
      await browser.close();
    }
  });
}
