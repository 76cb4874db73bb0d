// Pictures and recordings that a person takes of the page, beside the browser's own picture of it.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";

import { PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { decodePng } from "../support/png.mjs";

let browser;
before(async () => (browser = await launch({ webgpu: false })));
after(() => browser?.close());

/** The picture without what lies over it. */
const BARE = "#live > :not(#stage) { visibility: hidden !important }";

/** What a button hands over as a download. */
async function downloaded(page, selector) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

/** Mean difference of two pictures of one size, grey levels. */
function difference(a, b) {
  let sum = 0;
  const count = a.width * a.height;
  for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) sum += Math.abs(a.values[a.channels * i + k] - b.values[b.channels * i + k]);
  return sum / (3 * count);
}

/** The clip, found and stopped in a moment in which it is followed: a busy machine loses it now and then. */
async function stopped(page) {
  await page.click("#use-clip");
  for (let isFollowed = false; !isFollowed; ) {
    // The page may still be loading the clip: it plays by itself then.
    await page.evaluate(() => void document.querySelector("#video").play().catch(() => undefined));
    await page.waitForSelector('#live[data-mesh="true"]');
    await page.waitForSelector("#measures:not([hidden])");
    await page.evaluate(() => document.querySelector("#video").pause());
    // The tracker ends with the frame that it has.
    let last;
    for (let same = 0; same < 8; await page.waitForTimeout(250)) {
      const now = await page.evaluate(() => document.querySelector("#stage canvas:last-child").style.transform + document.querySelector("#track-ms").textContent);
      same = now === last ? same + 1 : 0;
      last = now;
    }
    isFollowed = await page.evaluate(() => document.querySelector("#state").dataset.how === "tracked");
  }
}

/** The browser's own picture of what is seen, without the controls, in CSS pixels. */
async function bare(page) {
  const style = await page.addStyleTag({ content: BARE });
  const picture = decodePng(await page.screenshot({ scale: "css" }));
  await style.evaluate((element) => element.remove());
  return picture;
}

const DEVICES = { desktop: { viewport: { width: 1000, height: 640 } }, phone: { ...PHONE, deviceScaleFactor: 1 } };
for (const [name, device] of Object.entries(DEVICES)) {
  test(`on a ${name} a picture holds what is seen, with the overlay`, { timeout: SLOW_MS }, async () => {
    const demo = await openDemo(browser, { device, query: "?device=cpu", prepare: allowStyles });
    const { page } = demo;
    await stopped(page);
    assert.match(await page.textContent("#measures"), /^(Flat|Bent by \d+°), \d+ cm away$/);
    await demo.screenshot(`shots-${name}`);
    const shown = await bare(page);
    const { name: file, bytes } = await downloaded(page, "#shots button:first-child");
    assert.match(file, /^deepsft .*\.png$/);
    const picture = decodePng(bytes);
    assert.deepEqual([picture.width, picture.height], [device.viewport.width, device.viewport.height]);
    assert.ok(difference(picture, shown) < 4, `${difference(picture, shown)} grey levels`);
    await page.click('[value="plain"]');
    const plain = decodePng((await downloaded(page, "#shots button:first-child")).bytes);
    assert.ok(difference(picture, plain) > 2, "the overlay is in the picture");
    await demo.finish();
  });
}

test("a recording has the page's size, plays, and shows what was seen; it is handed over on leaving too", { timeout: SLOW_MS }, async (t) => {
  const device = DEVICES.desktop;
  const demo = await openDemo(browser, { device, query: "?device=cpu", prepare: allowStyles });
  const { page } = demo;
  await page.click("#use-clip");
  await page.waitForSelector('#live[data-mesh="true"]');
  await page.click('[aria-label="Record a video"]');
  await page.waitForFunction(() => /0:0[5-9]/.test(document.querySelector("#shots .time").textContent));
  await demo.screenshot("shots-recording");
  const { name, bytes } = await downloaded(page, '[aria-label="End the recording"]');
  t.diagnostic(`${name}: ${bytes.length} bytes`);
  await page.waitForSelector('[aria-label="Record a video"]');
  const seen = await page.evaluate(async (base64) => {
    const blob = await (await fetch(`data:video/webm;base64,${base64}`)).blob().catch(() => null);
    const bytes = blob ?? new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]);
    const video = Object.assign(document.createElement("video"), { muted: true, src: URL.createObjectURL(bytes) });
    await video.play();
    const context = new OffscreenCanvas(64, 40).getContext("2d", { willReadFrequently: true });
    const frames = [];
    const take = () => {
      context.drawImage(video, 0, 0, 64, 40);
      frames.push([...context.getImageData(0, 0, 64, 40).data]);
    };
    const taking = setInterval(take, 300);
    await new Promise((resolve) => video.addEventListener("ended", resolve));
    clearInterval(taking);
    take();
    const mean = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;
    return { size: [video.videoWidth, video.videoHeight], seconds: video.currentTime, moved: mean(frames[0], frames.at(-1)), light: mean(frames[0], Array(frames[0].length).fill(0)) };
  }, bytes.toString("base64"));
  assert.deepEqual(seen.size, [device.viewport.width, device.viewport.height]);
  assert.ok(seen.seconds > 2, `${seen.seconds} s`);
  assert.ok(seen.moved > 1 && seen.light > 20, JSON.stringify(seen));
  await page.click('[aria-label="Record a video"]');
  await page.waitForFunction(() => document.querySelector("#shots .time").textContent === "0:01");
  assert.match((await downloaded(page, "#back")).name, /^deepsft .*\.(webm|mp4)$/);
  await demo.finish();
});

test("where the browser shares files it is asked to, and a person who changes their mind is left alone", { timeout: SLOW_MS }, async () => {
  const prepare = (context) =>
    context.addInitScript(() => {
      navigator.canShare = ({ files }) => files.every(({ type }) => type === "image/png");
      navigator.share = async ({ files }) => {
        globalThis.shared = files.map(({ name, size }) => [name, size > 1000]);
        throw new DOMException("not now", "AbortError");
      };
    });
  const demo = await openDemo(browser, { query: "?device=cpu", prepare });
  const { page } = demo;
  let downloads = 0;
  page.on("download", () => downloads++);
  await page.click("#use-clip");
  await page.waitForSelector('#live[data-mesh="true"]');
  await page.click("#shots button:first-child");
  await page.waitForFunction(() => globalThis.shared);
  assert.match(JSON.stringify(await page.evaluate(() => globalThis.shared)), /^\[\["deepsft .*\.png",true\]\]$/);
  assert.equal(downloads, 0);
  await demo.finish();
});

test("a browser that records nothing has no button for it", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu", prepare: (context) => context.addInitScript(() => delete globalThis.MediaRecorder) });
  await demo.page.click("#use-clip");
  await demo.page.waitForSelector("#shots button:first-child");
  assert.equal(await demo.page.isVisible('[aria-label="Record a video"]'), false);
  await demo.finish();
});

/** The page's policy forbids a test to add styles, and to fetch what it holds in memory. */
async function allowStyles(context) {
  await context.route("**/*", async (route) => {
    if (route.request().resourceType() !== "document") return route.continue();
    const response = await route.fetch();
    const text = (await response.text()).replace("style-src 'self'", "style-src 'self' 'unsafe-inline'").replace("connect-src 'self'", "connect-src 'self' data:");
    await route.fulfill({ response, body: text });
  });
}
