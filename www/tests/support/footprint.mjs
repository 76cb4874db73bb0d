// What a page and its workers hold on to: memory, pictures, nodes, listeners. Chromium's inspector says it, so nothing on the page is
// changed in order to be measured. Puppeteer drives here, for it talks to workers too, and hides a tab as a person does.

import { readFileSync } from "node:fs";
import puppeteer from "puppeteer-core";

import { startOptions } from "./browser.mjs";

/** With these a browser under test would not slow down a tab that nobody sees. */
const NEVER_IN_THE_BACKGROUND = [
  "--disable-backgrounding-occluded-windows",
  "--disable-renderer-backgrounding",
  "--disable-background-timer-throttling",
];

/** Handles of the inspector, which would themselves hold on to what they name. */
const OBJECT_GROUP = "footprint";

/** Kinds of objects, and how much of what each holds. */
const HELD = {
  wasmBytes: ["WebAssembly.Memory", "({ buffer }) => buffer.byteLength"],
  gpuObjects: ["GPUBuffer", "() => 1"],
  gpuBytes: ["GPUBuffer", "({ size }) => size"],
  gpuTextures: ["GPUTexture", "() => 1"],
  // Closed or sent away, a bitmap has no size.
  bitmaps: ["ImageBitmap", "({ width }) => Number(width > 0)"],
  videoFrames: ["VideoFrame", "({ format }) => Number(format !== null)"],
  webglTextures: ["WebGLTexture", "() => 1"],
  webglBuffers: ["WebGLBuffer", "() => 1"],
};

/**
 * What one thread holds.
 *
 * @typedef {Record<keyof typeof HELD | "heapBytes" | "arrayBytes", number>} ThreadFootprint
 */

/**
 * @typedef {object} Footprint
 * @property {ThreadFootprint} page
 * @property {ThreadFootprint | null} engine the engine's worker
 * @property {ThreadFootprint | null} tracker the tracker's
 * @property {number} workers how many there are
 * @property {number} nodes of the document
 * @property {number} listeners
 * @property {number} rendererBytes resident memory of the processes that run pages; 0 elsewhere than on Linux
 * @property {number} gpuProcessBytes of the one that draws
 */

/**
 * A browser whose tabs can be hidden.
 *
 * @param {import("./browser.mjs").LaunchOptions} options
 */
export function launchToMeasure(options) {
  const { executablePath, args } = startOptions(options);
  return puppeteer.launch({ executablePath, args, headless: false, ignoreDefaultArgs: NEVER_IN_THE_BACKGROUND, protocolTimeout: 600_000 });
}

/**
 * What a page of the site and its workers hold once all garbage is gone.
 *
 * @param {import("puppeteer-core").Page} page
 * @returns {Promise<Footprint>}
 */
export async function footprintOf(page) {
  const session = await page.createCDPSession();
  try {
    const threads = { engine: null, tracker: null };
    for (const { client } of page.workers()) threads[await partOf(client)] = await threadFootprint(client);
    const ofPage = await threadFootprint(session);
    await session.send("Performance.enable");
    const { metrics } = await session.send("Performance.getMetrics");
    const metric = (/** @type {string} */ name) => metrics.find((one) => one.name === name)?.value ?? 0;
    const counts = { workers: page.workers().length, nodes: metric("Nodes"), listeners: metric("JSEventListeners") };
    return { page: ofPage, ...threads, ...counts, ...(await processes(page.browser())) };
  } finally {
    await session.detach();
  }
}

/**
 * Finds the GPU devices of a page's workers, to be destroyed later, as when a driver is reset.
 *
 * @param {import("puppeteer-core").Page} page
 * @returns {Promise<() => Promise<number>>} destroys them and says how many there were
 */
export async function destroyerOfDevices(page) {
  const kept = { objectGroup: "devices" };
  const found = [];
  for (const { client } of page.workers()) {
    const { result } = await client.send("Runtime.evaluate", { expression: "globalThis.GPUDevice?.prototype", ...kept });
    if (!result.objectId) continue;
    const { objects } = await client.send("Runtime.queryObjects", { prototypeObjectId: result.objectId, ...kept });
    found.push({ client, objectId: objects.objectId });
  }
  return async () => {
    let destroyed = 0;
    for (const { client, objectId } of found) {
      const functionDeclaration = "function () { this.forEach((device) => device.destroy()); return this.length; }";
      destroyed += (await client.send("Runtime.callFunctionOn", { objectId, functionDeclaration, returnByValue: true })).result.value;
      // The page may have ended the worker by now, and its objects with it.
      await client.send("Runtime.releaseObjectGroup", kept).catch(() => undefined);
    }
    return destroyed;
  };
}

/** The part that a worker plays. @param {import("puppeteer-core").CDPSession} client */
async function partOf(client) {
  const expression = 'import("/pkg/deepsft_web.js").then(({ MeshTracker }) => MeshTracker.prototype)';
  return (await sumOfAll(client, { expression, awaitPromise: true }, "() => 1")) > 0 ? "tracker" : "engine";
}

/**
 * @param {import("puppeteer-core").CDPSession} client
 * @returns {Promise<ThreadFootprint>}
 */
async function threadFootprint(client) {
  const held = {};
  for (const [name, [type, amount]] of Object.entries(HELD)) held[name] = await sumOf(client, type, amount);
  // Twice: what the first time finalises the second lets go.
  for (let i = 0; i < 2; i++) await client.send("HeapProfiler.collectGarbage");
  const { usedSize, backingStorageSize } = await client.send("Runtime.getHeapUsage");
  return { ...held, heapBytes: usedSize, arrayBytes: backingStorageSize };
}

/**
 * @param {import("puppeteer-core").CDPSession} client
 * @param {string} type
 * @param {string} amount
 */
function sumOf(client, type, amount) {
  return sumOfAll(client, { expression: `globalThis.${type}?.prototype` }, amount);
}

/**
 * The sum of what `amount` says of each object of a kind that is still reachable.
 *
 * @param {import("puppeteer-core").CDPSession} client
 * @param {{ expression: string, awaitPromise?: boolean }} prototype
 * @param {string} amount
 * @returns {Promise<number>}
 */
async function sumOfAll(client, prototype, amount) {
  const kept = { objectGroup: OBJECT_GROUP };
  try {
    const { result: found } = await client.send("Runtime.evaluate", { ...prototype, ...kept });
    if (!found.objectId) return 0;
    const { objects } = await client.send("Runtime.queryObjects", { prototypeObjectId: found.objectId, ...kept });
    const { result, exceptionDetails } = await client.send("Runtime.callFunctionOn", {
      objectId: objects.objectId,
      functionDeclaration: `function () { return this.reduce((sum, one) => sum + (${amount})(one), 0); }`,
      returnByValue: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  } finally {
    await client.send("Runtime.releaseObjectGroup", kept);
  }
}

/** @param {import("puppeteer-core").Browser} browser */
async function processes(browser) {
  const session = await browser.target().createCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const bytes = (/** @type {string} */ kind) =>
    processInfo.filter(({ type }) => type === kind).reduce((sum, { id }) => sum + residentBytes(id), 0);
  return { rendererBytes: bytes("renderer"), gpuProcessBytes: bytes("GPU") };
}

/** @param {number} id of a process */
function residentBytes(id) {
  try {
    return 1024 * Number(/^VmRSS:\s+(\d+) kB/m.exec(readFileSync(`/proc/${id}/status`, "utf8"))?.[1] ?? 0);
  } catch {
    // It has ended, or this is no Linux.
    return 0;
  }
}
