// A device that suddenly becomes four times slower, as phones do when they get hot: the page's processes are held up by the system three
// quarters of the time, its workers with it. Nothing may pile up.

import assert from "node:assert/strict";
import { test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";

/** Of each 40 ms the page's processes run so many. */
const PERIOD_MS = 40;
const RUNNING_MS = 10;
/** So many tracked frames are watched. */
const WATCHED = 12;
/**
 * Questions under way at once, at most. The tracker follows one frame while the page draws the one before; finders and their answer come one
 * at a time.
 */
const MAX_UNDER_WAY = { follow: 2, find: 1, answer: 1 };

/** Has the system hold up the browser's pages until the returned function is called. */
async function slowDown(browser) {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  const ids = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => id);
  assert.ok(ids.length > 0);
  const signal = (name) => ids.forEach((id) => process.kill(id, name));
  let going;
  const clock = setInterval(() => {
    signal("SIGSTOP");
    going = setTimeout(signal, PERIOD_MS - RUNNING_MS, "SIGCONT");
  }, PERIOD_MS);
  return () => {
    clearInterval(clock);
    clearTimeout(going);
    signal("SIGCONT");
  };
}

const skip = process.platform === "win32" ? "processes cannot be held up" : false;

test("on a device that becomes four times slower nothing piles up, and frames are skipped", { timeout: SLOW_MS, skip }, async (t) => {
  const browser = await launch({ webgpu: false });
  try {
    const prepare = (context) =>
      context.addInitScript(() => {
        globalThis.seen = { shown: 0, tracked: 0, latencies: [], maxUnderWay: {}, maxFrames: 0, rests: [], finds: [] };
        globalThis.reset = () => {
          const now = seen;
          globalThis.seen = { shown: 0, tracked: 0, latencies: [], maxUnderWay: {}, maxFrames: 0, rests: [], finds: [] };
          return now;
        };
        const underWay = new Map();
        const { postMessage } = Worker.prototype;
        let foundAt = Number.NaN;
        const counted = (method) => [...underWay.values()].filter((call) => call.method === method).length;
        Worker.prototype.postMessage = function (message, ...given) {
          const { id, method } = message;
          if (!this.watched) {
            this.watched = true;
            this.addEventListener("message", ({ data }) => {
              const key = `${this.number} ${data.id}`;
              const call = underWay.get(key);
              underWay.delete(key);
              if (call?.method !== "find") return;
              foundAt = performance.now();
              seen.finds.push(foundAt - call.since);
            });
            this.number = globalThis.workers = (globalThis.workers ?? 0) + 1;
          }
          if (method === "find" && foundAt > 0) seen.rests.push(performance.now() - foundAt);
          underWay.set(`${this.number} ${id}`, { method, since: performance.now() });
          seen.maxUnderWay[method] = Math.max(seen.maxUnderWay[method] ?? 0, counted(method));
          for (const part of given[0] ?? []) letGo(part);
          return postMessage.call(this, message, ...given);
        };
        // Frames that are held: what is made less what is closed or sent away.
        let frames = 0;
        const made = new WeakSet();
        const letGo = (bitmap) => made.delete(bitmap) && frames--;
        const make = globalThis.createImageBitmap;
        globalThis.createImageBitmap = async (...given) => {
          const bitmap = await make(...given);
          made.add(bitmap);
          frames++;
          seen.maxFrames = Math.max(seen.maxFrames, frames);
          return bitmap;
        };
        const { close } = ImageBitmap.prototype;
        ImageBitmap.prototype.close = function () {
          letGo(this);
          return close.call(this);
        };
        document.addEventListener("deepsft-tracked", ({ tracked }) => {
          seen.tracked++;
          seen.latencies.push(tracked.times.totalMs);
        });
        addEventListener("DOMContentLoaded", () => {
          const video = document.querySelector("#video");
          const count = () => video.requestVideoFrameCallback(() => (seen.shown++, count()));
          count();
        });
      });
    const demo = await openDemo(browser, { query: "?device=cpu&model=models/poster-a4/", prepare });
    const { page } = demo;
    await page.click("#use-clip");
    await page.waitForSelector('#live[data-mesh="true"]');
    const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
    const watch = async (title) => {
      await page.evaluate(() => reset());
      await page.waitForFunction((most) => seen.tracked >= most, WATCHED, { polling: 100 });
      const seen = await page.evaluate(() => reset());
      const { shown, tracked, latencies, finds, rests, maxUnderWay, maxFrames } = seen;
      t.diagnostic(
        `${title}: ${tracked} of ${shown} frames, ${median(latencies)?.toFixed(0)} ms each, at most ${Math.max(...latencies).toFixed(0)}; ` +
          `${finds.length} searches, ${median(finds)?.toFixed(0)} ms each, after rests of ${median(rests)?.toFixed(0)}; ${maxFrames} frames held`,
      );
      for (const [method, most] of Object.entries(MAX_UNDER_WAY))
        assert.ok((maxUnderWay[method] ?? 0) <= most, `${title}: ${maxUnderWay[method]} of ${method} at once`);
      return seen;
    };
    const fast = await watch("fast");
    const release = await slowDown(browser);
    let slow;
    try {
      slow = await watch("four times slower");
    } finally {
      release();
    }
    await watch("fast again");
    assert.ok(slow.maxFrames <= fast.maxFrames + 2, `${slow.maxFrames} frames held, ${fast.maxFrames} before`);
    await demo.finish();
  } finally {
    await browser.close();
  }
});
