// The packed package in the places it is used from, each built and run: bundlers, Next.js, a plain import map, and a CDN, where
// scripts come from another origin than the page.

import assert from "node:assert/strict";
import { execFile, execFileSync } from "node:child_process";
import { cp, mkdir, mkdtemp, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { after, before, test } from "node:test";
import { build as buildWithVite } from "vite";
import webpack from "webpack";

import { ROOT, WWW, serve } from "../../serve.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";

/** What an application does: both workers have to start, and the engine's module to be found. */
const RUN = `
  async function run(withThree) {
    const sft = await DeepSft.load("/models/poster-a4/", { device: "cpu" });
    const canvas = Object.assign(document.createElement("canvas"), { width: 320, height: 240 });
    const context = canvas.getContext("2d");
    const painting = setInterval(() => context.fillRect(0, 0, Math.random() * 320, 240), 50);
    const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream(20) });
    document.body.append(video);
    await video.play();
    const estimate = await sft.estimate(canvas);
    const { value: tracked } = await sft.follow(video)[Symbol.asyncIterator]().next();
    clearInterval(painting);
    const outcome = { parameters: sft.info.parameters, depths: estimate.depth.values().length, number: tracked.number };
    const drawn = withThree?.(sft.targets[0], tracked);
    sft.close();
    return { ...outcome, ...drawn };
  }
  const told = (error) => ({ failed: String(error), code: error.code, cause: String(error.cause) });
`;
const APPLICATION = `
  import { DeepSft } from "deepsft";
  ${RUN}
  globalThis.outcome = run().catch(told);
`;

/** The target's mesh and the frame's camera, in a scene of three.js that is drawn. */
const WITH_THREE = `
  import { DeepSft } from "deepsft";
  import { FrameBackground, FrameCamera, Sheet } from "deepsft/three";
  import { Scene, WebGLRenderer } from "three";
  ${RUN}
  function draw(target, tracked) {
    const [renderer, scene, camera, background] = [new WebGLRenderer(), new Scene(), new FrameCamera(), new FrameBackground()];
    const sheet = new Sheet(target);
    camera.setIntrinsics(tracked.camera, { width: 320, height: 240 });
    background.show(tracked);
    sheet.update(tracked);
    renderer.render(scene.add(background, sheet), camera);
    return { vertices: sheet.geometry.getAttribute("position").count, draws: renderer.info.render.calls };
  }
`;
/** 31 x 22 vertices; the background alone is drawn, as no poster is there. */
const DRAWN = { vertices: 682, draws: 1 };

let folder;
/** For Next.js, which finds react and itself in the folders above. */
let nextFolder;
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
    await mkdir(join(WWW, "dist"), { recursive: true });
    nextFolder = await mkdtemp(join(WWW, "dist", "next-"));
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
  for (const made of [folder, nextFolder]) if (made) await rm(made, { recursive: true, force: true });
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

async function viteWithThree({ into }) {
  await symlink(join(WWW, "node_modules", "three"), join(folder, "node_modules", "three"));
  await writeFile(join(folder, "three.js"), `${WITH_THREE}\n globalThis.outcome = run(draw).catch(told);`);
  await writeFile(join(folder, "index.html"), html('<script type="module" src="/three.js"></script>'));
  await buildWithVite({ root: folder, logLevel: "error", configFile: false, build: { outDir: into, emptyOutDir: true } });
}

/** Its server prerenders the page: whatever is imported runs in Node.js first. */
async function next({ into }) {
  const page = `"use client";
    import { useEffect } from "react";
    ${WITH_THREE}
    export default function Page() {
      useEffect(() => void (globalThis.outcome = run(draw).catch(told)), []);
      return <p>{typeof DeepSft.load} {typeof Sheet}</p>;
    }`;
  const layout = `export default function Layout({ children }) {
    return <html lang="en"><head><link rel="icon" href="data:," /></head><body>{children}</body></html>;
  }`;
  await mkdir(join(nextFolder, "app"));
  await writeFile(join(nextFolder, "app", "page.js"), page);
  await writeFile(join(nextFolder, "app", "layout.js"), layout);
  await writeFile(join(nextFolder, "next.config.mjs"), 'export default { output: "export" };');
  await writeFile(join(nextFolder, "package.json"), '{ "private": true, "type": "module" }');
  await mkdir(join(nextFolder, "node_modules"));
  await cp(join(folder, "node_modules", "deepsft"), join(nextFolder, "node_modules", "deepsft"), { recursive: true });
  const program = join(WWW, "node_modules", "next", "dist", "bin", "next");
  const env = { ...process.env, NEXT_TELEMETRY_DISABLED: "1", NODE_ENV: "production" };
  await promisify(execFile)(process.execPath, [program, "build"], { cwd: nextFolder, env });
  await cp(join(nextFolder, "out"), into, { recursive: true });
  assert.match(await readFile(join(into, "index.html"), "utf8"), /function<!-- --> <!-- -->function/, "the page was prerendered");
}

async function webpacked({ base, into }) {
  const compiler = webpack({
    mode: "production",
    context: folder,
    entry: "./main.js",
    output: { path: into, filename: "main.js", publicPath: base },
    // Once is enough: it takes longer than all the rest.
    optimization: { minimize: base === "/" },
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

for (const [name, build, where, drawn] of [
  ["Vite", vite, "page"],
  ["Vite with its files on a CDN", vite, "cdn"],
  ["webpack", webpacked, "page"],
  ["webpack with its files on a CDN", webpacked, "cdn"],
  ["Vite and three.js", viteWithThree, "page", DRAWN],
  ["Next.js and three.js", next, "page", DRAWN],
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
      await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
      const outcome = await page.evaluate(() => globalThis.outcome);
      assert.deepEqual({ ...outcome, parameters: outcome.parameters > 1e5 }, { parameters: true, depths: 480 * 270, number: 1, ...drawn }, JSON.stringify(outcome));
      assert.deepEqual(problems, []);
      assert.equal(origins.has(cdn.origin), onCdn, `requests went to ${[...origins]}`);
      await page.close();
    } finally {
      await server.close();
    }
  });
}
