// What a frame costs: nothing is drawn twice, nothing is written that nobody sees.

import assert from "node:assert/strict";
import { test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";

/** Frames of the clip that are looked at. */
const FRAMES = 12;

/** A small page: on a machine without a GPU the processor draws it. */
const SMALL = { viewport: { width: 480, height: 400 } };

/** Has the page count what WebGL draws and takes in, and how many frames of the video were followed. */
async function countDraws(page) {
  await page.evaluate(async () => {
    globalThis.drawn = { frames: 0, passes: 0, uploads: 0 };
    const count = (name, counter) => {
      const before = WebGL2RenderingContext.prototype[name];
      WebGL2RenderingContext.prototype[name] = function (...given) {
        drawn[counter]++;
        return before.apply(this, given);
      };
    };
    for (const name of ["drawArrays", "drawElements"]) count(name, "passes");
    for (const name of ["texImage2D", "texSubImage2D"]) count(name, "uploads");
    document.addEventListener("deepsft-tracked", () => drawn.frames++);
  });
}

test("where the processor draws, each frame is drawn once, in the box of its mesh, and the depth scale is written only while it is shown", { timeout: SLOW_MS }, async () => {
  const browser = await launch();
  try {
    const demo = await openDemo(browser, { device: SMALL, query: "?device=cpu" });
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
    // What hides, and the paper.
    assert.ok(drawn.passes <= 2 * (drawn.frames + 1), JSON.stringify(drawn));
    // The frame itself never goes through WebGL.
    assert.equal(drawn.uploads, 0);
    const boxHandle = await page.waitForFunction(() => {
      const box = document.querySelector("#stage canvas:last-child").getBoundingClientRect();
      return box.width > 0 && box.toJSON();
    });
    const drawnBox = await boxHandle.jsonValue();
    // How near the sheet is depends on where in the clip a busy machine has come to.
    assert.ok(drawnBox.width * drawnBox.height < 0.85 * SMALL.viewport.width * SMALL.viewport.height, JSON.stringify(drawnBox));
    assert.equal(written, 0);
    await page.click('[value="depth"]');
    await page.waitForFunction(() => globalThis.written > 1 && document.querySelectorAll("#scale-ticks span").length > 0);
    await demo.finish();
  } finally {
    await browser.close();
  }
});
