// The packed package in the places it is used from, each built and run: bundlers, a plain import map, and a CDN, where
// scripts come from another origin than the page.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdir, mkdtemp, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { after, before, test } from "node:test";
import { build as buildWithVite } from "vite";
import webpack from "webpack";

import { ROOT, WWW, serve } from "../../serve.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";

/** What an application does: both workers have to start, and the engine's module to be found. */
const APPLICATION = `
  import { DeepSft } from "deepsft";

  globalThis.outcome = (async () => {
    const sft = await DeepSft.load("/models/poster-a4/", { device: "cpu" });
    const canvas = Object.assign(document.createElement("canvas"), { width: 320, height: 240 });
    const context = canvas.getContext("2d");
    const painting = setInterval(() => context.fillRect(0, 0, Math.random() * 320, 240), 50);
    const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream(20) });
    document.body.append(video);
    await video.play();
    const estimate = await sft.estimate(canvas);
    const tracked = await new Promise((resolve, reject) => {
      const tracking = sft.trackMesh(video, resolve);
      tracking.finished.catch(reject);
    });
    clearInterval(painting);
    const outcome = { parameters: sft.info.parameters, depths: estimate.depth.values().length, number: tracked.number };
    sft.close();
    return outcome;
  })().catch((error) => ({ failed: String(error), code: error.code, cause: String(error.cause) }));
`;

let folder;
let browser;
/** Another origin, that lets every page read it. */
let cdn;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-bundlers-"));
    const packed = execFileSync("npm", ["pack", "--pack-destination", folder, "--silent"], { cwd: WWW, encoding: "utf8" });
    const installed = join(folder, "node_modules", "deepsft");
    await mkdir(installed, { recursive: true });
    execFileSync("tar", ["-xzf", join(folder, packed.trim()), "-C", installed, "--strip-components", "1"]);
    await writeFile(join(folder, "main.js"), APPLICATION);
    await writeFile(join(folder, "package.json"), '{ "type": "module" }');
    await mkdir(join(folder, "cdn"));
    await symlink(installed, join(folder, "cdn", "deepsft"));
    cdn = await serve({ folders: { "/": join(folder, "cdn") }, headers: { "access-control-allow-origin": "*" } });
    browser = await launch({ webgpu: false });
  },
  { timeout: SLOW_MS },
);
after(async () => {
  await browser?.close();
  await cdn?.close();
  await rm(folder, { recursive: true, force: true });
});

/** @param {string} head of the page that starts the application */
const html = (head) => `<!doctype html><link rel="icon" href="data:," />${head}<body></body>`;

/**
 * @param {{ base: string, into: string }} options base: address of what is built
 */
async function vite({ base, into }) {
  await writeFile(join(folder, "index.html"), html('<script type="module" src="/main.js"></script>'));
  await buildWithVite({ root: folder, base, logLevel: "error", configFile: false, build: { outDir: into, emptyOutDir: true } });
}

async function webpacked({ base, into }) {
  const compiler = webpack({
    mode: "production",
    context: folder,
    entry: "./main.js",
    output: { path: into, filename: "main.js", publicPath: base },
    performance: { hints: false },
  });
  const stats = await promisify(compiler.run.bind(compiler))();
  assert.equal(stats.hasErrors(), false, stats.toString({ all: false, errors: true }));
  await promisify(compiler.close.bind(compiler))();
  await writeFile(join(into, "index.html"), html(`<script src="${base === "auto" ? "/" : base}main.js" defer></script>`));
}

/** The package as it is, by an import map. */
async function importMap({ base, into }) {
  await mkdir(into, { recursive: true });
  const imports = JSON.stringify({ imports: { deepsft: `${base}deepsft/src/index.js` } });
  const map = `<script type="importmap">${imports}</script>`;
  await writeFile(join(into, "index.html"), html(`${map}<script type="module">${APPLICATION}</script>`));
}


for (const [name, build, where] of [
  ["Vite", vite, "page"],
  ["Vite with its files on a CDN", vite, "cdn"],
  ["webpack", webpacked, "page"],
  ["webpack with its files on a CDN", webpacked, "cdn"],
  ["an import map", importMap, "page"],
  ["an import map that names a CDN", importMap, "cdn"],
]) {
  test(`the packed package works with ${name}`, { timeout: SLOW_MS }, async () => {
    const into = join(folder, "cdn", name.replaceAll(" ", "-"));
    const onCdn = where === "cdn";
    const files = build === importMap ? "" : `${name.replaceAll(" ", "-")}/`;
    const base = onCdn ? `${cdn.origin}/${files}` : "/";
    await build({ base, into });
    const own = build === importMap ? { "/deepsft/": join(folder, "node_modules", "deepsft") } : {};
    const server = await serve({ folders: { "/models/": join(ROOT, "models"), ...own, "/": into } });
    try {
      const page = await browser.newPage();
      const problems = [];
      page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
      page.on("pageerror", (error) => problems.push(String(error)));
      const origins = new Set();
      page.on("request", (request) => request.url().startsWith("http") && origins.add(new URL(request.url()).origin));
      await page.goto(`${server.origin}/`);
      await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: 20_000 });
      const outcome = await page.evaluate(() => globalThis.outcome);
      assert.deepEqual({ ...outcome, parameters: outcome.parameters > 1e5 }, { parameters: true, depths: 480 * 270, number: 1 }, JSON.stringify(outcome));
      assert.deepEqual(problems, []);
      assert.equal(origins.has(cdn.origin), onCdn, `requests went to ${[...origins]}`);
      await page.close();
    } finally {
      await server.close();
    }
  });
}
