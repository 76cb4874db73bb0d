// What the browser keeps of a model, as the server of the model sees it.

import assert from "node:assert/strict";
import { cp, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { createHash } from "node:crypto";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { WWW, serve } from "../../serve.mjs";
import { BLANK, SLOW_MS, contextOf, launch } from "../support/browser.mjs";
import { MODEL } from "../support/native.mjs";

const FILES = ["template/template.json", "template/texture.png", "weights.bpk"];

let browser;
let folder;
let server;
let context;
/** Names of the model's files that were asked for. */
let asked;

before(async () => (browser = await launch({ webgpu: false })));
after(() => browser?.close());
beforeEach(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-kept-"));
  for (const name of ["model.json", ...FILES]) await cp(join(MODEL, name), join(folder, name));
  server = await serve({ folders: { "/model/": folder, "/": WWW } });
  context = await contextOf(browser, {});
  asked = [];
});
afterEach(async () => {
  await server.close();
  await rm(folder, { recursive: true, force: true });
});

/**
 * A visit: loads the model in a page of its own.
 *
 * @param {object} [options] of `DeepSft.load`
 * @param {() => void} [prepare] run in the page before all else
 * @returns {Promise<{ name: string, asked: string[], kept: string[], progress: object }>} `kept` are addresses without their origin
 */
async function visit(options = {}, prepare = () => undefined) {
  asked.length = 0;
  const page = await context.newPage();
  page.on("request", (request) => {
    const [, name] = new URL(request.url()).pathname.split("/model/");
    if (name) asked.push(name);
  });
  await page.addInitScript(prepare);
  await page.goto(server.origin + BLANK);
  const seen = await page.evaluate(async (options) => {
    const { DeepSft } = await import("/src/index.js");
    let progress;
    const onProgress = (step) => step.phase === "model" && (progress = step);
    const sft = await DeepSft.load("/model/", { device: "cpu", onProgress, ...options }).catch((error) => ({ info: { modelName: error.code } }));
    const name = sft.info.modelName;
    sft.close?.();
    const keys = globalThis.caches ? await caches.open("deepsft-models").then((cache) => cache.keys(), () => []) : [];
    return { name, progress, kept: keys.map(({ url }) => new URL(url).pathname + new URL(url).search).sort() };
  }, options);
  await page.close();
  return { ...seen, asked: [...asked].sort() };
}

const everything = ["model.json", ...FILES].sort();
const keyOf = async (name) => `/model/${name}?sha256=${createHash("sha256").update(await readFile(join(folder, name))).digest("hex")}`;

/** Writes another version of a file of the model, and model.json to it. */
async function change(name, bytes) {
  await writeFile(join(folder, name), bytes);
  const manifest = JSON.parse(await readFile(join(folder, "model.json"), "utf8"));
  manifest.files[name] = { size: bytes.length, sha256: createHash("sha256").update(bytes).digest("hex") };
  await writeFile(join(folder, "model.json"), JSON.stringify(manifest));
}

test("the second visit asks for model.json alone, and counts every byte as loaded", { timeout: SLOW_MS }, async () => {
  const first = await visit();
  assert.deepEqual([first.name, first.asked], ["poster-a4", everything]);
  assert.deepEqual(first.kept, await Promise.all(FILES.map(keyOf)));
  const second = await visit();
  assert.deepEqual([second.name, second.asked, second.kept], ["poster-a4", ["model.json"], first.kept]);
  assert.equal(second.progress.loadedBytes, second.progress.totalBytes);
});

test("of a bundle that changed the new files alone are fetched, and the old ones go", { timeout: SLOW_MS }, async () => {
  const before = await visit();
  const template = JSON.parse(await readFile(join(folder, FILES[0]), "utf8"));
  await change(FILES[0], Buffer.from(JSON.stringify(template, null, 5)));
  const seen = await visit();
  assert.deepEqual([seen.name, seen.asked], ["poster-a4", ["model.json", FILES[0]]]);
  assert.deepEqual(seen.kept, await Promise.all(FILES.map(keyOf)));
  assert.notDeepEqual(seen.kept, before.kept);
});

test("a kept file that is damaged is thrown away and fetched again", { timeout: SLOW_MS }, async () => {
  await visit();
  const key = await keyOf("weights.bpk");
  const page = await context.newPage();
  await page.goto(server.origin + BLANK);
  await page.evaluate(async (key) => (await caches.open("deepsft-models")).put(key, new Response("damaged")), key);
  await page.close();
  const seen = await visit();
  assert.deepEqual([seen.name, seen.asked], ["poster-a4", ["model.json", "weights.bpk"]]);
  assert.deepEqual((await visit()).asked, ["model.json"], "the good one is kept");
});

test("a file that is not what model.json says is refused and never kept", { timeout: SLOW_MS }, async () => {
  const bytes = await readFile(join(folder, "weights.bpk"));
  bytes[bytes.length >> 1] ^= 1;
  await writeFile(join(folder, "weights.bpk"), bytes);
  const seen = await visit();
  assert.deepEqual([seen.name, seen.kept.length], ["model-corrupt", 2]);
  assert.deepEqual(seen.asked, [...everything, "weights.bpk"].sort(), "asked once more, past the browser's HTTP cache");
});

test("where nothing may or can be kept the model is fetched each time", { timeout: SLOW_MS }, async () => {
  const cases = [
    [{ keep: false }, () => undefined],
    [{}, () => delete globalThis.caches],
    [{}, () => (CacheStorage.prototype.open = () => Promise.reject(new DOMException("private window", "SecurityError")))],
    [{}, () => (Cache.prototype.put = () => Promise.reject(new DOMException("full", "QuotaExceededError")))],
  ];
  for (const [options, prepare] of cases) {
    const seen = await visit(options, prepare);
    assert.deepEqual([seen.name, seen.asked, seen.kept], ["poster-a4", everything, []], String(prepare));
  }
});
