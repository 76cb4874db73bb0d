// The page as `cargo xtask site` writes it, below a path of its own, as on GitHub Pages.

import assert from "node:assert/strict";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { writeSite } from "../../site.mjs";
import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";

test("the static site runs the clip and an example with three.js below any path, its pages can be searched, and it asks for nothing outside of it", { timeout: SLOW_MS }, async () => {
  const folder = await mkdtemp(join(tmpdir(), "deepsft-site-"));
  const browser = await launch();
  try {
    await writeSite(join(folder, "sub"));
    const paths = new Set();
    const prepare = async (context) =>
      context.on("request", (request) => {
        if (request.url().startsWith("http")) paths.add(new URL(request.url()).pathname);
      });
    const demo = await openDemo(browser, { folders: { "/": folder }, path: "/sub/", query: "?device=cpu", prepare });
    const links = await demo.page.evaluate(async () => {
      const links = [...document.querySelectorAll("a[href]")].filter((link) => link.origin === location.origin);
      return Promise.all(links.map(async ({ href }) => [href, (await fetch(href, { method: "HEAD" })).status]));
    });
    assert.ok(links.length >= 3, "the page has links");
    for (const [href, status] of links) assert.equal(status, 200, href);
    await demo.page.click("#use-clip");
    await demo.page.waitForSelector('#state[data-state="found"]');
    await demo.page.goto(`${demo.origin}/sub/examples/object.html?clip`);
    // Its hint goes when the sheet is found.
    await demo.page.waitForSelector("p:empty", { state: "attached" });
    await demo.page.goto(`${demo.origin}/sub/docs/index.html`);
    await demo.page.fill("input[type=search]", "print laid flat");
    await demo.page.click("#sections a:has-text('Flat')");
    await demo.page.waitForSelector("h2#flat");
    await demo.page.click("nav a:has-text('API reference')");
    await demo.page.waitForSelector("a[href='modules/deepsft_scene.html']");
    await demo.finish();
    const outside = [...paths].filter((path) => !path.startsWith("/sub/"));
    assert.deepEqual(outside, [], "requests outside of the site");
  } finally {
    await browser.close();
    await rm(folder, { recursive: true, force: true });
  }
});
