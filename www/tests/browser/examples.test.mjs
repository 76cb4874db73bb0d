// Each example as the list of them copies it, pasted into a file on another server, before the clip or a camera. Those with three.js are judged by their pixels in three.test.mjs.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { WWW, serve } from "../../serve.mjs";
import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { MODEL } from "../support/native.mjs";
import { posterScan } from "../support/scans.mjs";

const FOLDER = join(WWW, "examples");
const NAMES = readdirSync(FOLDER).filter((name) => name.endsWith(".html") && name !== "index.html").map((name) => name.replace(".html", ""));
const MINT = [0x5f, 0xe3, 0xbd];
const AMBER = [0xf2, 0xb8, 0x61];

let browser;
/** The site, which lets pages of others read it as most hosts of static files do; a list of its examples; and where they are pasted. */
let site, list, folder, elsewhere;
before(async () => {
  browser = await launch({ webgpu: false });
  site = await serve({ headers: { "access-control-allow-origin": "*" } });
  const context = await browser.newContext({ permissions: ["clipboard-read", "clipboard-write"] });
  list = await context.newPage();
  await list.goto(`${site.origin}/examples/index.html`);
  folder = await mkdtemp(join(tmpdir(), "deepsft-examples-"));
  elsewhere = await serve({ folders: { "/": folder } });
});
after(async () => {
  await browser?.close();
  await Promise.all([site, elsewhere].map((server) => server?.close()));
  await rm(folder, { recursive: true, force: true });
});

/** Copies an example, pastes it into a file, and opens that with the clip. */
async function onClip(name, body) {
  await list.bringToFront();
  await list.click(`[data-copied="${name}.html"]`);
  await list.waitForFunction(() => document.querySelector("[role=status]").textContent === "Copied");
  await writeFile(join(folder, `${name}.html`), await list.evaluate(() => ((document.querySelector("[role=status]").textContent = ""), navigator.clipboard.readText())));
  const page = await (await browser.newContext({ viewport: { width: 960, height: 540 } })).newPage();
  page.setDefaultTimeout(SLOW_MS / 2);
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  await page.goto(`${elsewhere.origin}/${name}.html?clip`);
  await body(page);
  await page.screenshot({ path: join(WWW, "tests", "screenshots", `example-${name}.png`) });
  await page.context().close();
  assert.deepEqual(problems, []);
}

/** Waits until the canvas has so many pixels of a colour, about. */
const waitForColor = (page, color, least) =>
  page.waitForFunction(
    ([color, least]) => {
      const canvas = document.querySelector("canvas");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let count = 0;
      for (let i = 0; i < data.length; i += 4) if (color.every((value, k) => Math.abs(data[i + k] - value) < 12)) count++;
      return count >= least;
    },
    [color, least],
    { polling: 250 },
  );

const found = (page) => page.waitForSelector("p:empty", { state: "attached" });

async function downloaded(page, selector) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

const TESTS = {
  mesh: (page) => waitForColor(page, MINT, 500),
  async label(page) {
    await found(page);
    // Both at one moment in which it is shown: a busy machine loses the sheet now and then, and hides it.
    const boxes = await page.waitForFunction(() => {
      const [label, canvas] = [".label", "canvas"].map((selector) => document.querySelector(selector)?.getBoundingClientRect().toJSON());
      return label?.width > 0 && document.querySelector(".label").style.transform && { label, canvas };
    });
    const { label, canvas } = await boxes.jsonValue();
    // The balloon is in the middle of the poster's upper half, which is in the middle of the clip's picture.
    assert.ok(label.x > canvas.x + 200 && label.x + label.width < canvas.x + canvas.width - 100, JSON.stringify(label));
    assert.ok(label.width > 40 && label.width < 300 && label.height < 120, JSON.stringify(label));
    const moved = await page.waitForFunction((before) => document.querySelector(".label").style.transform !== before, await page.locator(".label").evaluate(({ style }) => style.transform));
    assert.ok(moved);
  },
  async measure(page) {
    await page.waitForSelector("output:not(:empty)");
    const [, distance, bend] = /^(\d+) cm away, bent by (\d+)°$/.exec(await page.textContent("output"));
    assert.ok(distance > 25 && distance < 90 && bend < 160, `${distance} cm, ${bend}°`);
  },
  async two(page) {
    await Promise.all([waitForColor(page, MINT, 400), waitForColor(page, AMBER, 400)]);
  },
  async "own-picture"(page) {
    await page.waitForSelector("input[type=file]:enabled");
    await page.setInputFiles("input[type=file]", { name: "grey.png", mimeType: "image/png", buffer: Buffer.from("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg==", "base64") });
    await page.waitForFunction(() => document.querySelector("p > span").textContent.length > 20);
    await page.locator("input[type=number]").fill("297");
    await page.setInputFiles("input[type=file]", join(MODEL, "template", "texture.png"));
    await page.waitForFunction(() => document.querySelector("p > span").textContent === "texture.png is there");
    await waitForColor(page, MINT, 400);
  },
  async scan(page) {
    await page.waitForSelector("input[type=file]:enabled");
    await page.setInputFiles("input[type=file]", { name: "words.obj", mimeType: "model/obj", buffer: Buffer.from("v one") });
    await page.waitForFunction(() => document.querySelector("p > span").textContent.includes("line 1"));
    await page.setInputFiles("input[type=file]", await posterScan());
    await page.waitForFunction(() => document.querySelector("p > span").textContent === "poster.glb is there");
    await waitForColor(page, MINT, 400);
  },
  async still(page) {
    await page.waitForFunction(() => /^There it is: \d+ %/.test(document.querySelector("span").textContent));
    await waitForColor(page, MINT, 400);
    await page.setInputFiles("input[type=file]", join(WWW, "demo", "icon.png"));
    await page.waitForFunction(() => document.querySelector("span").textContent === "Not found");
  },
  async events(page) {
    await page.waitForFunction(() => /poster found in frame \d+$/.test(document.querySelector("li")?.textContent));
    // Then a grey picture.
    await page.evaluate(() => {
      const canvas = Object.assign(document.createElement("canvas"), { width: 960, height: 540 });
      const pen = canvas.getContext("2d");
      setInterval(() => {
        pen.fillStyle = pen.fillStyle === "#808080" ? "#818181" : "#808080";
        pen.fillRect(0, 0, 960, 540);
      }, 50);
      const video = document.querySelector("video");
      video.removeAttribute("src");
      video.srcObject = canvas.captureStream(20);
      return video.play();
    });
    await page.waitForFunction(() => /poster lost in frame \d+$/.test(document.querySelector("li").textContent));
    assert.ok((await page.locator("li").count()) >= 2);
  },
  async record(page) {
    await found(page);
    await page.click("text=Record");
    await page.waitForTimeout(2000);
    const { name, bytes } = await downloaded(page, "text=Stop");
    assert.match(name, /^sheet\.(mp4|webm)$/);
    assert.ok(bytes.length > 10_000, `${bytes.length} bytes`);
    await page.waitForSelector("text=Record");
  },
  async depth(page) {
    await found(page);
    // Red is near, violet is far: both are on any sheet that is not seen from straight ahead.
    await Promise.all([waitForColor(page, [0xf4, 0x25, 0x25], 30), waitForColor(page, [0x6a, 0x25, 0xf4], 5)]);
  },
  async export(page) {
    await found(page);
    const { name, bytes } = await downloaded(page, "button:enabled");
    const lines = String(bytes).split("\n").map((line) => line.split(" "));
    const of = (kind) => lines.filter(([word]) => word === kind);
    assert.equal(name, "sheet.obj");
    assert.deepEqual([of("v").length, of("vt").length, of("f").length], [682, 682, 1260]);
    const corners = of("f").flatMap(([, ...corners]) => corners.map((corner) => Number(corner.split("/")[0])));
    assert.deepEqual([Math.min(...corners), Math.max(...corners)], [1, 682]);
    const depths = of("v").map(([, , , z]) => Number(z));
    assert.ok(Math.max(...depths) < -200 && Math.min(...depths) > -1200, "in front of the camera");
  },
  // In scene.test.mjs too.
  async flat(page) {
    await page.waitForSelector("#ar > [data-deepsft=running]");
    await page.evaluate(() => {
      // A busy machine may have a frame in which the sheet is not found: the button says so, and is pressed again.
      const button = document.querySelector("button");
      new MutationObserver(() => button.textContent.startsWith("Not seen") && button.click()).observe(button, { childList: true });
      button.click();
    });
    await page.waitForSelector("#flat[width='800'][height='565']");
  },
  // In scene.test.mjs, and as the README has them in tests/engines/programs.test.mjs, too.
  "scene-film": (page) => page.waitForFunction(() => [...document.querySelectorAll("#ar video")].some(({ src, currentTime, paused }) => src && currentTime > 0.2 && !paused)),
  async aframe(page) {
    // A-Frame draws the whole window with the processor here, which has less time to follow the sheet.
    await page.waitForFunction(() => (document.querySelector("video").playbackRate = 0.25) && document.querySelector("a-torus").object3D?.parent?.parent?.parent?.visible);
    // The ring is drawn where the poster is.
    await page.waitForFunction(async () => {
      const [scene, context] = [document.querySelector("a-scene"), document.createElement("canvas").getContext("2d")];
      const { width, height } = await createImageBitmap(await scene.components.deepsft.view.shot()).then((picture) => (Object.assign(context.canvas, { width: picture.width, height: picture.height }), context.drawImage(picture, 0, 0), picture));
      const { data } = context.getImageData(width / 4, height / 4, width / 2, height / 2);
      let orange = 0;
      for (let i = 0; i < data.length; i += 4) if (data[i] > 120 && data[i] > 1.8 * data[i + 1] && data[i] > 2.5 * data[i + 2]) orange++;
      return orange > 100;
    });
  },
  "scene-object": (page) => page.waitForSelector("#ar > [data-deepsft=running]"),
  // In three.test.mjs too.
  object: found,
  paper: found,
  video: found,
};

for (const name of NAMES) {
  test(`the example ${name} does what it says, in less than 60 lines`, { timeout: SLOW_MS }, async () => {
    assert.ok(readFileSync(join(FOLDER, `${name}.html`), "utf8").split("\n").length <= 60);
    await onClip(name, TESTS[name]);
  });
}

test("the files that the examples name are on the site too", async () => {
  for (const name of NAMES) {
    const addresses = readFileSync(join(FOLDER, `${name}.html`), "utf8").match(/(?<=["'])\.\.?\/[^"']*/g);
    for (const address of addresses) assert.equal((await fetch(new URL(address, `${site.origin}/examples/`))).status, 200, `${name}: ${address}`);
  }
});

test("the list has every example, with its picture and its source", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { path: "/examples/index.html" });
  const { page } = demo;
  const listed = await page.locator("[data-file]").evaluateAll((buttons) => buttons.map(({ dataset }) => dataset.file.replace(".html", "")));
  assert.deepEqual(listed.toSorted(), NAMES);
  const sizes = await page.locator("img").evaluateAll((images) =>
    Promise.all(images.map(async (image) => ((image.loading = "eager"), await image.decode(), [image.naturalWidth, image.naturalHeight]))),
  );
  assert.deepEqual(sizes, NAMES.map(() => [480, 270]));
  for (const link of await page.locator("a").evaluateAll((links) => links.map(({ href }) => href)))
    assert.equal((await page.request.get(link)).status(), 200, link);
  await page.click('[data-file="mesh.html"]');
  await page.waitForFunction(() => document.querySelector("pre").textContent.includes("sft.follow"));
  await demo.screenshot("examples-source");
  await page.keyboard.press("Escape");
  assert.equal(await page.isVisible("dialog"), false);
  await demo.screenshot("examples");
  await demo.finish();
});
