// What a frame costs: nothing is drawn twice, nothing is written that nobody sees.

import assert from "node:assert/strict";
import { test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";

/** Frames of the clip that are looked at. */
const FRAMES = 12;

/** A small page: on a machine without a GPU the processor draws it. */
const SMALL = { viewport: { width: 480, height: 400 } };

/** Adds to each page of a context: WebGL draws on what looks like a GPU, by its name and by a clock that runs from frame to frame, so that papers move. */
const likeGpu = (context) =>
  context.addInitScript(() => {
    const { getParameter } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getParameter = function (name) {
      const value = getParameter.call(this, name);
      return typeof value === "string" && /swiftshader|llvmpipe|softpipe/i.test(value) ? "Test GPU" : value;
    };
    const request = globalThis.requestAnimationFrame;
    globalThis.inScreenFrame = false;
    let now = 0;
    globalThis.requestAnimationFrame = (callback) =>
      request(() => {
        globalThis.inScreenFrame = true;
        callback((now += 1000 / 60));
        globalThis.inScreenFrame = false;
      });
  });

/** Has the page count how often its stage is drawn, and how many frames of the video it has taken. */
async function countDraws(page) {
  await page.evaluate(async () => {
    globalThis.drawn = { animated: 0, beside: 0, still: 0, frames: 0, passes: 0, uploads: 0 };
    const { Stage } = await import("/demo/stage/stage.js");
    const { draw } = Stage.prototype;
    Stage.prototype.draw = function (seconds) {
      drawn[!this.animated ? "still" : inScreenFrame ? "animated" : "beside"]++;
      draw.call(this, seconds);
    };
    const { drawArrays, texImage2D } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.drawArrays = function (...given) {
      drawn.passes++;
      drawArrays.apply(this, given);
    };
    WebGL2RenderingContext.prototype.texImage2D = function (...given) {
      drawn.uploads++;
      texImage2D.apply(this, given);
    };
    document.addEventListener("deepsft-tracked", () => drawn.frames++);
  });
}

const hasFrames = (page, count) => page.waitForFunction((most) => globalThis.drawn.frames >= most, count);

test("a stage that is animated is drawn by the screen's frames alone, also when a frame of the video comes", { timeout: SLOW_MS }, async () => {
  const browser = await launch();
  try {
    const demo = await openDemo(browser, { device: SMALL, query: "?device=cpu", prepare: likeGpu });
    const { page } = demo;
    await countDraws(page);
    await page.click("#use-clip");
    await hasFrames(page, FRAMES);
    const drawn = await page.evaluate(() => globalThis.drawn);
    assert.ok(drawn.animated >= 3, JSON.stringify(drawn));
    assert.equal(drawn.beside, 0, JSON.stringify(drawn));
    await demo.finish();
  } finally {
    await browser.close();
  }
});

test("where the processor draws, each frame is one pass over the box of its mesh, and the depth scale is written only while it is shown", { timeout: SLOW_MS }, async () => {
  const browser = await launch();
  try {
    const demo = await openDemo(browser, { device: SMALL, query: "?device=cpu", prepare: (context) => context.addInitScript(() => (globalThis.inScreenFrame = false)) });
    const { page } = demo;
    await page.click("#use-clip");
    await page.waitForSelector('#live[data-mesh="true"]');
    await countDraws(page);
    await page.evaluate(() => {
      globalThis.written = 0;
      new MutationObserver((changes) => (globalThis.written += changes.length)).observe(document.querySelector("#scale"), {
        ...{ attributes: true, childList: true, subtree: true },
      });
    });
    // Where the sheet is lost nothing is drawn: a busy machine loses it now and then.
    await page.waitForFunction((most) => globalThis.drawn.frames >= most && globalThis.drawn.passes >= most / 2, FRAMES);
    const { drawn, written } = await page.evaluate(() => ({ drawn: { ...globalThis.drawn }, written: globalThis.written }));
    assert.equal(drawn.animated + drawn.beside, 0);
    assert.ok(drawn.still <= drawn.frames + 1, JSON.stringify(drawn));
    // The frame itself never goes through WebGL, nor a picture of the light.
    assert.ok(drawn.passes <= drawn.frames + 1, JSON.stringify(drawn));
    assert.equal(drawn.uploads, 0);
    const boxHandle = await page.waitForFunction(() => {
      const box = document.querySelector("#stage").getBoundingClientRect();
      return box.width > 0 && box.toJSON();
    });
    const drawnBox = await boxHandle.jsonValue();
    // How near the sheet is depends on where in the clip a busy machine has come to.
    assert.ok(drawnBox.width * drawnBox.height < 0.85 * SMALL.viewport.width * SMALL.viewport.height, JSON.stringify(drawnBox));
    assert.equal(written, 0);
    await page.click('[data-overlay="depth"]');
    await page.waitForFunction(() => globalThis.written > 1 && document.querySelectorAll("#scale-ticks span").length > 0);
    await demo.finish();
  } finally {
    await browser.close();
  }
});
