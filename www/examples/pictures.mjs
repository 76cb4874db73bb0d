// Makes the pictures of the examples' list: each example before the demo page's clip. After `cargo xtask web`:
//
//     node pictures.mjs [NAME.html …]

import { readdirSync } from "node:fs";
import { fileURLToPath } from "node:url";

import { serve } from "../serve.mjs";
import { launch } from "../tests/support/browser.mjs";
import { posterScan } from "../tests/support/scans.mjs";

const POSTER = fileURLToPath(new URL("../../models/poster-a4/template/texture.png", import.meta.url));
/** So far the clip has played, seconds. */
const SECONDS = 4;

const wanted = process.argv.slice(2);
const names = readdirSync(new URL(".", import.meta.url)).filter((name) => name.endsWith(".html") && name !== "index.html" && (wanted.length === 0 || wanted.includes(name)));
const server = await serve();
const browser = await launch({ webgpu: false });
try {
  for (const name of names) {
    const page = await browser.newPage({ viewport: { width: 640, height: 360 }, deviceScaleFactor: 0.75 });
    page.on("pageerror", (error) => console.error(name, error));
    await page.goto(`${server.origin}/examples/${name}?clip`);
    if (["own-picture.html", "scan.html"].includes(name)) {
      await page.waitForSelector("input[type=file]:enabled");
      if (name === "own-picture.html") await page.locator("input[type=number]").fill("297");
      await page.setInputFiles("input[type=file]", name === "scan.html" ? await posterScan() : POSTER);
      await page.waitForFunction(() => document.querySelector("p > span").textContent.endsWith("is there"));
    }
    if (name === "still.html") await page.waitForFunction(() => document.querySelector("p > span").textContent.startsWith("There"));
    else await page.waitForFunction((least) => [...document.querySelectorAll("video")].some(({ currentTime }) => currentTime > least), SECONDS);
    if (name === "flat.html") {
      await page.waitForSelector("[data-deepsft=running]");
      await page.click("button:has-text('flat')");
      await page.waitForSelector("#flat[width]");
    }
    if (/^(scene-|aframe)/.test(name)) await page.waitForSelector("[data-deepsft=running]");
    await page.screenshot({ path: fileURLToPath(new URL(`pictures/${name.replace("html", "jpg")}`, import.meta.url)), type: "jpeg", quality: 82 });
    await page.close();
  }
} finally {
  await browser.close();
  await server.close();
}
