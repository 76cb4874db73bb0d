// The site when its server is gone, or has another version.

import assert from "node:assert/strict";
import { appendFile, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { serve } from "../../serve.mjs";
import { writeSite } from "../../site.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";

let browser;
let folder;
let server;
let context;

before(async () => (browser = await launch({ webgpu: false })));
after(() => browser?.close());
beforeEach(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-offline-"));
  await writeSite(join(folder, "sub"));
  server = await serve({ folders: { "/": folder } });
  context = await browser.newContext();
  context.setDefaultTimeout(SLOW_MS / 2);
  // A first visit keeps nothing: first-visit.test.mjs.
  await (await visit()).close();
});
afterEach(async () => {
  await context.close();
  await server?.close();
  await rm(folder, { recursive: true, force: true });
});

/** The site's address stays the same when the server is started again. */
const address = () => `${server.origin}/sub/`;

async function visit(url = address()) {
  const page = await context.newPage();
  await page.goto(url);
  return page;
}

/** Waits until the page is kept. @param {import("playwright-core").Page} page */
const kept = (page) => page.evaluate(async () => void (await navigator.serviceWorker.ready));

/** Waits until a function on the page answers with something true; the page may be loaded again meanwhile. */
async function until(page, body, argument) {
  for (let end = Date.now() + SLOW_MS / 4; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 100)))
    if (await page.evaluate(body, argument).catch(() => false)) return;
  throw new Error(`not: ${body}`);
}

const cacheNames = (page) => page.evaluate(() => caches.keys());
const versionOf = (page) => page.evaluate(async () => (await import("./demo/offline/version.js")).VERSION);
const isOf = (page, version) => until(page, async (version) => (await import("./demo/offline/version.js")).VERSION === version, version);
const messages = (page) => page.evaluate(async () => (await fetch("demo/messages.js")).text());

/** Stops the server for as long as `body` takes. */
async function serverless(body) {
  const port = new URL(server.origin).port;
  await server.close();
  await context.setOffline(true);
  try {
    await body();
  } finally {
    await context.setOffline(false);
    server = await serve({ port: Number(port), folders: { "/": folder } });
  }
}

test("after two visits the clip is followed, and an example runs, without a server", { timeout: SLOW_MS }, async () => {
  const page = await visit();
  await kept(page);
  await serverless(async () => {
    await page.reload();
    await page.click("#use-clip");
    await page.waitForSelector('#state[data-how="tracked"]');
    await page.waitForSelector('#live[data-mesh="true"]');
    await page.close();
    const example = await visit(`${address()}examples/object.html?clip`);
    await example.waitForSelector("p:empty", { state: "attached" });
  });
});

test("players get the part of a kept file that they ask for, also its end", { timeout: SLOW_MS }, async () => {
  const page = await visit();
  await kept(page);
  await page.reload();
  await serverless(async () => {
    const answers = await page.evaluate(async () => {
      const { byteLength } = await (await fetch("demo/icon.png")).arrayBuffer();
      const asked = async (range) => {
        const response = await fetch("demo/icon.png", { headers: { range } });
        return [response.status, (await response.arrayBuffer()).byteLength, response.headers.get("content-range")?.replaceAll(`${byteLength}`, "N")];
      };
      return Promise.all(["bytes=0-9", "bytes=-100", "bytes=10-", `bytes=${byteLength}-`, "bytes=0-1,4-5"].map(asked)).then((all) => [byteLength, ...all]);
    });
    const [length, ...seen] = answers;
    assert.deepEqual(seen.map(([status, bytes]) => [status, bytes]), [[206, 10], [206, 100], [206, length - 10], [416, 0], [200, length]]);
    assert.equal(seen[1][2], `bytes ${length - 100}-${length - 1}/N`);
  });
});

test("a new version takes the old one's place as a whole, at once where nothing goes on", { timeout: SLOW_MS }, async () => {
  const page = await visit();
  await kept(page);
  const [old] = await cacheNames(page);
  const first = await versionOf(page);
  await appendFile(join(folder, "sub/demo/messages.js"), "\n// A new version.\n");
  // Not yet: the list still names the old file.
  await page.reload();
  assert.doesNotMatch(await messages(page), /A new version/);
  assert.deepEqual(await cacheNames(page), [old]);

  const { version } = await republish();
  assert.notEqual(version, first);
  await page.reload();
  await isOf(page, version);
  assert.match(await messages(page), /A new version/);
  await until(page, async () => (await caches.keys()).length === 1);
  assert.notDeepEqual(await cacheNames(page), [old]);
});

/** Lists the files of the folder as they are now, as site.mjs does. */
async function republish() {
  const { offlineFiles } = await import("../../site.mjs");
  const names = (await readFile(join(folder, "sub/site.txt"), "utf8")).split("\n").filter((name) => name.includes(".") && !name.includes(" "));
  const written = await offlineFiles(new Map(names.map((name) => [name, join(folder, "sub", name)])));
  for (const [name, content] of Object.entries(written)) await writeFile(join(folder, "sub", name), content);
  return { version: /VERSION = "(\w+)"/.exec(written["demo/offline/version.js"])[1] };
}

test("a version of which a file is missing or another is not taken", { timeout: SLOW_MS }, async () => {
  const page = await visit();
  await kept(page);
  const names = await cacheNames(page);
  await appendFile(join(folder, "sub/demo/messages.js"), "\n// A new version.\n");
  const { version } = await republish();
  await appendFile(join(folder, "sub/demo/messages.js"), "\n// Not the one that is listed.\n");
  await page.reload();
  const states = await page.evaluate(async () => {
    const registration = await navigator.serviceWorker.ready;
    const worker = registration.installing ?? (await new Promise((resolve) => registration.addEventListener("updatefound", () => resolve(registration.installing))));
    await new Promise((resolve) => worker.addEventListener("statechange", () => worker.state !== "installing" && resolve()));
    return [worker.state, registration.waiting, registration.active.state];
  });
  assert.deepEqual(states, ["redundant", null, "activated"]);
  await page.reload();
  assert.notEqual(await versionOf(page), version);
  assert.ok((await cacheNames(page)).includes(names[0]));
  await serverless(async () => {
    await page.reload();
    await page.waitForSelector("#use-clip");
  });
});

test("two windows keep their version until one is closed", { timeout: SLOW_MS }, async () => {
  const pages = [await visit()];
  await kept(pages[0]);
  pages.push(await visit());
  const first = await versionOf(pages[1]);
  await appendFile(join(folder, "sub/demo/messages.js"), "\n// A new version.\n");
  const { version } = await republish();
  await pages[1].reload();
  await until(pages[1], async () => (await navigator.serviceWorker.ready).waiting !== null);
  // What would take its place has been told to by now, and would have.
  await pages[1].evaluate(() => new Promise((resolve) => setTimeout(resolve, 500)));
  for (const page of pages) assert.equal(await versionOf(page), first);
  await pages[0].close();
  await isOf(pages[1], version);
});

test("the development server keeps nothing, and lets go of a site that was there", { timeout: SLOW_MS }, async () => {
  const page = await visit();
  await kept(page);
  await rm(join(folder, "sub/service-worker.js"));
  await writeFile(join(folder, "sub/demo/offline/version.js"), "export const VERSION = null;");
  // The page loads itself again, perhaps before this load has ended.
  await page.reload({ waitUntil: "commit" });
  await until(page, async () => (await navigator.serviceWorker.getRegistration()) === undefined && navigator.serviceWorker.controller === null);
  await isOf(page, null);
});

test("with --offline the development server has the service worker too", { timeout: SLOW_MS }, async () => {
  const port = Number(new URL(server.origin).port);
  await server.close();
  server = await serve({ port, offline: true });
  const page = await visit(`${server.origin}/`);
  await kept(page);
  await serverless(async () => {
    await page.reload();
    await page.click("#use-clip");
    await page.waitForSelector('#live[data-mesh="true"]');
  });
});
