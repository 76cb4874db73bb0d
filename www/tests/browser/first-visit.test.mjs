// What a first visit to the site fetches: nothing of what the person did not ask for, and how much until the clip's sheet has its mesh.

import assert from "node:assert/strict";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

import { serve } from "../../serve.mjs";
import { writeSite } from "../../site.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";

/** What hosts of static files compress. */
const COMPRESSED = new Set([".html", ".js", ".mjs", ".css", ".json", ".svg", ".webmanifest", ".wasm"]);
/** What the start screen may take, and all until the first mesh, bytes on the wire. */
const [MAX_START, MAX_MESH] = [450_000, 3_000_000];
/** So long the page stands open first, milliseconds. */
const READING_MS = 4000;

test("a first visit fetches what the person asks for alone; a second one is kept", { timeout: SLOW_MS }, async (t) => {
  const folder = await mkdtemp(join(tmpdir(), "deepsft-first-"));
  const browser = await launch({ webgpu: false });
  await writeSite(folder);
  const server = await serve({ folders: { "/": folder } });
  try {
    const context = await browser.newContext();
    const fetched = new Map();
    // Workers' and service workers' requests too.
    context.on("request", (request) => request.url().startsWith(server.origin) && fetched.set(new URL(request.url()).pathname.slice(1) || "index.html", null));
    const bytes = async () => {
      for (const name of fetched.keys()) {
        const content = await readFile(join(folder, name));
        fetched.set(name, COMPRESSED.has(extname(name)) ? gzipSync(content).length : content.length);
      }
      return [...fetched.values()].reduce((sum, length) => sum + length, 0);
    };
    const page = await context.newPage();
    await page.goto(`${server.origin}/?device=cpu`);
    await page.waitForTimeout(READING_MS);
    const start = await bytes();
    assert.deepEqual([...fetched.keys()].filter((name) => /^(models|three|examples|docs|aframe|uqr)\/|\.wasm$|clip|service-worker|live\/live/.test(name)), [], "before the click");
    assert.equal(await page.evaluate(async () => (await navigator.serviceWorker.getRegistrations()).length), 0);

    const began = performance.now();
    await page.click("#use-clip");
    await page.waitForSelector('#live[data-mesh="true"]');
    const seconds = (performance.now() - began) / 1000;
    const all = await bytes();
    const dearest = [...fetched].sort(([, a], [, b]) => b - a).slice(0, 8);
    t.diagnostic(`the start screen ${start} bytes, until the first mesh ${all} bytes and ${seconds.toFixed(1)} s from the click; ${fetched.size} files: ${dearest.map((file) => file.join(" ")).join(", ")}`);
    assert.deepEqual([...fetched.keys()].filter((name) => /^(models|examples|docs|aframe|uqr)\/|service-worker/.test(name)), [], "after it");
    assert.ok(start < MAX_START && all < MAX_MESH, `${start} and ${all} bytes: ${JSON.stringify(dearest)}`);

    await page.reload();
    await page.evaluate(async () => void (await navigator.serviceWorker.ready));
  } finally {
    await browser.close();
    await server.close();
    await rm(folder, { recursive: true, force: true });
  }
});
