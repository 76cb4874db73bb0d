// Makes the pictures of three.md: the examples, before the demo page's clip. After `cargo xtask web`:
//
//     node pictures.mjs

import { fileURLToPath } from "node:url";

import { serve } from "../../serve.mjs";
import { launch } from "../../tests/support/browser.mjs";

/** The examples, and how far the clip has played, seconds. */
const PICTURES = { object: 2.5, paper: 5, video: 4 };

const server = await serve();
const browser = await launch({ webgpu: false });
try {
  for (const [name, seconds] of Object.entries(PICTURES)) {
    const page = await browser.newPage({ viewport: { width: 640, height: 360 } });
    page.on("pageerror", (error) => console.error(error));
    await page.goto(`${server.origin}/examples/${name}.html?clip`);
    await page.waitForSelector("p:empty", { state: "attached" });
    await page.waitForFunction((least) => document.querySelector("video").currentTime > least, seconds);
    await page.screenshot({ path: fileURLToPath(new URL(`${name}.jpg`, import.meta.url)), type: "jpeg", quality: 85 });
    await page.close();
  }
} finally {
  await browser.close();
  await server.close();
}
