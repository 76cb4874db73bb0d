// How one gets about in the page: the browser's way back, the keyboard, and what is told when one has gone on.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";

let browser;
before(async () => (browser = await launch({ webgpu: false, testCameras: 1 })));
after(() => browser?.close());

/** The page, without its clip: it stays where it waits. */
async function onPage(body, options = {}) {
  const demo = await openDemo(browser, { query: "?device=cpu", ...options });
  await body(demo.page, demo);
  await demo.finish();
}
const viewOf = (page) => page.evaluate(() => document.body.dataset.view);
const focused = (page) => page.evaluate(() => document.activeElement.id);

test("the browser's way back leads to the start, as the page's own does, and from there away", { timeout: SLOW_MS }, () =>
  onPage(async (page) => {
    const title = await page.title();
    const length = await page.evaluate(() => history.length);
    for (const back of [() => page.goBack(), () => page.click("#back"), () => page.goBack()]) {
      await page.click("#use-clip");
      assert.deepEqual([await viewOf(page), await focused(page)], ["live", "back"]);
      assert.notEqual(await page.title(), title);
      await back();
      await page.waitForFunction(() => document.body.dataset.view === "start" && history.state === null);
      assert.deepEqual([await focused(page), await page.title()], ["choose-picture", title]);
    }
    assert.equal(await page.evaluate(() => history.length), length + 1, "no view leaves more behind");
    // Back, and on at once.
    await page.click("#use-clip");
    await page.evaluate(() => (document.querySelector("#back").click(), document.querySelector("#use-clip").click()));
    await page.waitForTimeout(300);
    assert.equal(await viewOf(page), "live");
    await page.goBack();
    await page.waitForFunction(() => document.body.dataset.view === "start");
  }),
);

test("an address that ends in #clip shows the clip at once, and what is shown has that address only while it is the clip", { timeout: SLOW_MS }, () =>
  onPage(
    async (page) => {
      const hash = () => page.evaluate(() => location.hash);
      await page.waitForSelector('#state[data-state="found"]');
      assert.deepEqual([await viewOf(page), await hash()], ["live", "#clip"]);
      await page.goBack();
      await page.waitForFunction(() => document.body.dataset.view === "start" && history.state === null);
      assert.equal(await hash(), "");
      await page.click("#use-camera");
      assert.deepEqual([await viewOf(page), await hash()], ["live", ""]);
      await page.click("#back");
      await page.waitForFunction(() => document.body.dataset.view === "start" && history.state === null);
      await page.click("#use-clip");
      assert.equal(await hash(), "#clip");
    },
    { query: "?device=cpu#clip", permissions: ["camera"] },
  ),
);

test("a message holds the keyboard, Escape leaves it, and the focus goes back to the page", { timeout: SLOW_MS }, () =>
  onPage(
    async (page) => {
      await page.focus("#use-camera");
      await page.keyboard.press("Enter");
      assert.equal((await messageOf(page)).code, "camera-denied");
      for (let i = 0; i < 8; i++) {
        await page.keyboard.press("Tab");
        assert.ok(await page.evaluate(() => document.activeElement === document.body || document.activeElement.closest("#message") !== null));
      }
      await page.keyboard.press("Escape");
      assert.deepEqual([await viewOf(page), await page.isVisible("#message"), await focused(page)], ["start", false, "choose-picture"]);
    },
    { prepare: (context) => context.addInitScript(() => void (navigator.mediaDevices && (navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("", "NotAllowedError"))))) },
  ),
);

test("a radio group is one stop of the keyboard, in which arrow keys choose", { timeout: SLOW_MS }, () =>
  onPage(async (page) => {
    await page.click("#use-clip");
    await page.waitForSelector("#overlays");
    const chosen = () => page.evaluate(() => document.activeElement.matches(":checked") && document.activeElement.value);
    await page.focus('#overlays [value="paper"]');
    for (const [key, overlay] of [["ArrowRight", "object"], ["ArrowDown", "shaded"], ["ArrowLeft", "object"], ["ArrowUp", "paper"], ["ArrowLeft", "plain"]]) {
      await page.keyboard.press(key);
      assert.equal(await chosen(), overlay, key);
    }
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.closest("#overlays")), null);
    for (const [name, count] of [["What to draw over the picture", 6], ["What to print", 0], ["What stands on the sheet", 0]])
      assert.equal(await page.getByRole("group", { name }).getByRole("radio").count(), count, name);
    assert.equal(await page.getByRole("button", { name: "Details", exact: true }).count(), 1, "the rate is no name");
  }),
);

test("a camera that is interrupted takes no photograph until it is back", { timeout: SLOW_MS }, () =>
  onPage(
    async (page) => {
      await page.click("#photograph");
      await page.waitForSelector("#capture .shutter:enabled");
      for (const [event, disabled] of [["mute", true], ["unmute", false]]) {
        await page.evaluate((event) => document.querySelector("#capture video").srcObject.getVideoTracks()[0].dispatchEvent(new Event(event)), event);
        await page.waitForFunction((disabled) => document.querySelector("#capture .shutter").disabled === disabled, disabled);
      }
    },
    { permissions: ["camera"] },
  ),
);

test("a recording that the browser ends lets its tracks go, and a drawing that it keeps to itself is explained", { timeout: SLOW_MS }, () =>
  onPage(async (page) => {
    const { message, states } = await page.evaluate(async () => {
      const { Recording } = await import("/src/index.js");
      const tracks = [];
      const { captureStream } = HTMLCanvasElement.prototype;
      HTMLCanvasElement.prototype.captureStream = function (...options) {
        const stream = captureStream.apply(this, options);
        tracks.push(...stream.getTracks());
        return stream;
      };
      const { start } = MediaRecorder.prototype;
      MediaRecorder.prototype.start = function () {
        queueMicrotask(() => this.dispatchEvent(new Event("error")));
      };
      const recording = new Recording(Object.assign(document.createElement("canvas"), { width: 64, height: 48 }));
      const message = await recording.finished.catch((error) => error.message);
      MediaRecorder.prototype.start = start;
      return { message, states: tracks.map(({ readyState }) => readyState) };
    });
    assert.deepEqual([message, states], ["The browser ended the recording.", ["ended"]]);
    const code = await page.evaluate(async () => {
      const { pictureFrom } = await import("/demo/own/read-picture.js");
      CanvasRenderingContext2D.prototype.getImageData = () => {
        throw new DOMException("tainted", "SecurityError");
      };
      try {
        pictureFrom(Object.assign(document.createElement("canvas"), { width: 100, height: 100 }), 100, 100, "drawing.svg");
      } catch (error) {
        return error.code;
      }
    });
    assert.equal(code, "image-unreadable");
  }),
);

test("what was chosen before is not put into what is looked at now", { timeout: SLOW_MS }, () =>
  onPage(async (page) => {
    const used = await page.evaluate(async () => {
      const [{ Subjects }, { Live }] = await Promise.all([import("/demo/subjects.js"), import("/demo/live/live.js")]);
      const waiting = [];
      Subjects.prototype.ready = function () {
        const { kind } = this;
        return new Promise((resolve) => waiting.push(() => resolve({ kind, sft: { info: {} }, target: {} })));
      };
      const used = [];
      Live.prototype.show = ({ kind }) => new Promise(() => used.push(kind));
      const click = (selector) => document.querySelector(selector).click();
      click("#use-clip");
      click("#back");
      click("#use-clip");
      while (waiting.length < 2) await new Promise((resolve) => setTimeout(resolve, 20));
      waiting[1]();
      waiting[0]();
      for (let waited = 0; waited < 100 && used.length === 0; waited++) await new Promise((resolve) => setTimeout(resolve, 50));
      await new Promise((resolve) => setTimeout(resolve, 200));
      return used;
    });
    assert.deepEqual(used, ["picture"]);
  }),
);
