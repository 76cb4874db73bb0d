// The page as a phone opens it: by the network's address, over https with a certificate that nobody vouches for.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { lanAddresses } from "../../lan.mjs";
import { WWW } from "../../serve.mjs";
import { PHONE, SLOW_MS, launch } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { y4m } from "../support/y4m.mjs";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_031;
const skip = lanAddresses().length > 0 ? false : "this machine is in no network";

test("by the network's address the camera opens, the sheet is found, and nothing is amiss without a service worker", { timeout: SLOW_MS, skip }, async () => {
  const folder = await mkdtemp(join(tmpdir(), "deepsft-lan-"));
  const server = spawn(process.execPath, [join(WWW, "serve.mjs"), "--offline", "--lan"], { stdio: ["ignore", "pipe", "inherit"] });
  let said = "";
  server.stdout.on("data", (chunk) => (said += chunk));
  try {
    const { frames } = await makeClip({ event: "still", frames: 1, seed: SEED, upright: true });
    const camera = join(folder, "camera.y4m");
    await writeFile(camera, y4m([frames[0].picture, frames[0].picture], 10));
    while (!said.includes("everybody")) await once(server.stdout, "data");
    const [address] = said.match(/https:\S+/);
    const browser = await launch({ webgpu: false, camera });
    try {
      const refused = await (await browser.newContext()).newPage();
      await assert.rejects(refused.goto(address), /ERR_CERT_AUTHORITY_INVALID/, "the browser warns");
      // As a person does who reads what the terminal says.
      const context = await browser.newContext({ ...PHONE, ignoreHTTPSErrors: true, permissions: ["camera"] });
      const problems = [];
      context.on("console", (message) => message.type() === "error" && problems.push(message.text()));
      context.on("weberror", (error) => problems.push(String(error.error())));
      const page = await context.newPage();
      page.setDefaultTimeout(SLOW_MS);
      await page.goto(`${address}?device=cpu`);
      await page.click("#use-camera");
      await page.waitForSelector('#state[data-state="found"]');
      assert.equal(await page.evaluate(() => isSecureContext), true);
      assert.equal(await page.evaluate(async () => (await navigator.serviceWorker.getRegistrations()).length), 0);
      assert.deepEqual(problems, []);
    } finally {
      await browser.close();
    }
  } finally {
    server.kill();
    await rm(folder, { recursive: true, force: true });
  }
});
