// The packed package in the places it is used from, each built or started, and run: bundlers, their development servers, Next.js, pages
// without a bundler, and a CDN, where scripts come from another origin than the page.

import assert from "node:assert/strict";
import { execFile, execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { cp, mkdir, mkdtemp, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { after, before, test } from "node:test";
import { build as buildWithEsbuild } from "esbuild";
import { build as buildWithVite } from "vite";
import webpack from "webpack";

import { ROOT, WWW, serve } from "../../serve.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";
import { MADE } from "../support/native.mjs";

/** What an application does: both workers have to start, and the engine's module to be found. */
const RUN = `
  async function run(withThree, options) {
    const sft = await DeepSft.load("/models/poster-a4/", { device: "cpu", ...options });
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

/** For those that do not find the worker: they are told where it is. */
const APPLICATION_TOLD = APPLICATION.replace("run()", 'run(undefined, { baseUrl: "/deepsft/" })');

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
    await mkdir(MADE, { recursive: true });
    nextFolder = await mkdtemp(join(MADE, "next-"));
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

/** It leaves the addresses of files as they are, as Angular does, which is made of it. */
async function esbuilt({ into }) {
  await writeFile(join(folder, "told.js"), APPLICATION_TOLD);
  await buildWithEsbuild({ entryPoints: [join(folder, "told.js")], bundle: true, format: "esm", outfile: join(into, "main.js"), logLevel: "error" });
  await cp(join(folder, "node_modules", "deepsft", "dist"), join(into, "deepsft"), { recursive: true });
  await writeFile(join(into, "index.html"), html('<script type="module" src="/main.js"></script>'));
}

/** The package as it is, without a bundler, by an import map. */
async function importMap({ base, into }) {
  await mkdir(into, { recursive: true });
  const imports = JSON.stringify({ imports: { deepsft: `${base}deepsft/dist/deepsft.js` } });
  const map = `<script type="importmap">${imports}</script>`;
  await writeFile(join(into, "index.html"), html(`${map}<script type="module">${APPLICATION}</script>`));
}

/** Opens the application, waits for what becomes of it, and compares. */
async function opens(origin, drawn) {
  const page = await browser.newPage();
  const problems = [];
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  page.on("pageerror", (error) => problems.push(String(error)));
  const origins = new Set();
  page.on("request", (request) => request.url().startsWith("http") && origins.add(new URL(request.url()).origin));
  await page.goto(`${origin}/`);
  await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
  const outcome = await page.evaluate(() => globalThis.outcome);
  assert.deepEqual({ ...outcome, parameters: outcome.parameters > 1e5 }, { parameters: true, depths: 480 * 270, number: 1, ...drawn }, JSON.stringify(outcome));
  assert.deepEqual(problems, []);
  await page.close();
  return origins;
}

for (const [name, build, where, drawn] of [
  ["Vite with its files on a CDN", vite, "cdn"],
  ["webpack", webpacked, "page"],
  ["webpack with its files on a CDN", webpacked, "cdn"],
  ["Vite and three.js", viteWithThree, "page", DRAWN],
  ["Next.js and three.js", next, "page", DRAWN],
  ["esbuild", esbuilt, "page"],
  ["an import map that names a CDN", importMap, "cdn"],
]) {
  test(`the packed package works with ${name}`, { timeout: SLOW_MS }, async () => {
    const into = join(folder, "cdn", name.replaceAll(" ", "-"));
    const onCdn = where === "cdn";
    const files = build === importMap ? "" : `${name.replaceAll(" ", "-")}/`;
    const base = onCdn ? `${cdn.origin}/${files}` : "/";
    await build({ base, into });
    const server = await serve({ folders: { "/models/": join(ROOT, "models"), "/": into } });
    try {
      const origins = await opens(server.origin, drawn);
      assert.equal(origins.has(cdn.origin), onCdn, `requests went to ${[...origins]}`);
    } finally {
      await server.close();
    }
  });
}

/** docs/scene.md: its three.js is installed as the page's. */
const WITH_AFRAME = `
  import AFRAME from "aframe";
  import "deepsft/aframe";
  document.body.innerHTML = '<a-scene embedded style="height: 200px" deepsft="picture: /models/poster-a4/template/texture.png"></a-scene>';
  const scene = document.querySelector("a-scene");
  scene.addEventListener("started", ({ detail: { view } }) => (globalThis.outcome = { isOne: view.camera instanceof AFRAME.THREE.PerspectiveCamera && scene.camera === view.camera }));
  scene.addEventListener("error", ({ detail: { error } }) => (globalThis.outcome ??= told(error)));
  const told = ({ code, message }) => ({ code, message });
`;

for (const [name, three, outcome] of [
  ["works with Vite and A-Frame, which share a three.js", "aframe/node_modules/three", { isOne: true }],
  ["says so where A-Frame has a three.js of its own", "three", { code: "invalid-argument" }],
]) {
  test(`the packed package ${name}`, { timeout: SLOW_MS }, async () => {
    const root = await mkdtemp(join(folder, "aframe-"));
    await mkdir(join(root, "node_modules"));
    await cp(join(folder, "node_modules", "deepsft"), join(root, "node_modules", "deepsft"), { recursive: true });
    await symlink(join(WWW, "node_modules", "aframe"), join(root, "node_modules", "aframe"));
    await symlink(join(WWW, "node_modules", three), join(root, "node_modules", "three"));
    await writeFile(join(root, "main.js"), WITH_AFRAME);
    await writeFile(join(root, "index.html"), html('<script type="module" src="/main.js"></script>'));
    await buildWithVite({ root, logLevel: "error", configFile: false });
    const server = await serve({ folders: { "/models/": join(ROOT, "models"), "/": join(root, "dist") } });
    const page = await browser.newPage();
    await page.goto(`${server.origin}/`);
    await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
    const { message, ...seen } = await page.evaluate(() => globalThis.outcome);
    assert.deepEqual(seen, outcome, message);
    await page.close();
    await server.close();
  });
}

/** A port that nobody has, for servers that take none for any. */
async function freePort() {
  const { port, close } = await serve();
  await close();
  return port;
}

/** A development server of Vite; the model lies in its folder of public files. */
async function viteServer(name, config) {
  const { createServer } = await import(name);
  const root = await mkdtemp(join(folder, `${name}-`));
  await mkdir(join(root, "public", "models"), { recursive: true });
  await symlink(join(ROOT, "models", "poster-a4"), join(root, "public", "models", "poster-a4"));
  await writeFile(join(root, "main.js"), APPLICATION);
  await writeFile(join(root, "index.html"), html('<script type="module" src="/main.js"></script>'));
  const server = await createServer({ root, configFile: false, logLevel: "error", server: { port: await freePort(), strictPort: true }, ...config });
  await server.listen();
  return { origin: `http://localhost:${server.httpServer.address().port}`, close: () => server.close() };
}

test("Vite 7 that is not told so moves the package, and the error says what to tell it", { timeout: SLOW_MS }, async () => {
  const server = await viteServer("vite-7", {});
  const page = await browser.newPage();
  await page.goto(`${server.origin}/`);
  await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
  const { code, failed } = await page.evaluate(() => globalThis.outcome);
  assert.deepEqual([code, /optimizeDeps: \{ exclude: \["deepsft"\] \}/.test(failed)], ["engine-load", true], failed);
  await page.close();
  await server.close();
});

/** The development server of Next.js, after the build above has made the application. React is in strict mode there. */
async function nextServer() {
  const port = await freePort();
  const program = join(WWW, "node_modules", "next", "dist", "bin", "next");
  const env = { ...process.env, NEXT_TELEMETRY_DISABLED: "1", NODE_ENV: "development" };
  await mkdir(join(nextFolder, "public", "models"), { recursive: true });
  await symlink(join(ROOT, "models", "poster-a4"), join(nextFolder, "public", "models", "poster-a4"));
  // With a group of its own: it starts others.
  const server = spawn(process.execPath, [program, "dev", "--port", String(port)], { cwd: nextFolder, env, detached: true, stdio: "ignore" });
  const origin = `http://localhost:${port}`;
  while (!(await fetch(origin).catch(() => null))) {
    assert.equal(server.exitCode, null, "the development server of Next.js has ended");
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
  return { origin, close: () => process.kill(-server.pid) };
}

for (const [name, start, drawn] of [
  ["Vite 6, told to leave it alone", () => viteServer("vite-6", { optimizeDeps: { exclude: ["deepsft"] } })],
  ["Vite 7, told to leave it alone", () => viteServer("vite-7", { optimizeDeps: { exclude: ["deepsft"] } })],
  ["Vite 8", () => viteServer("vite", {})],
  ["Next.js", nextServer, DRAWN],
]) {
  test(`the packed package works with the development server of ${name}`, { timeout: SLOW_MS }, async () => {
    const server = await start();
    try {
      await opens(server.origin, drawn);
    } finally {
      await server.close();
    }
  });
}

/** A page on a server of its own with the package in /deepsft/, and its model. */
async function pageWith(page, headers = {}) {
  const into = await mkdtemp(join(folder, "page-"));
  await writeFile(join(into, "index.html"), page);
  return serve({ folders: { "/models/": join(ROOT, "models"), "/deepsft/": join(folder, "node_modules", "deepsft", "dist"), "/": into }, headers });
}

const ISOLATED = { "cross-origin-embedder-policy": "require-corp", "cross-origin-opener-policy": "same-origin" };

const BY_TAG = APPLICATION.replace('"deepsft"', '"/deepsft/deepsft.js"');

for (const [name, headers, policy] of [
  ["cross-origin isolation", ISOLATED],
  ["Trusted Types", {}, "require-trusted-types-for 'script'; trusted-types deepsft"],
]) {
  test(`the packed package works in a page with ${name}`, { timeout: SLOW_MS }, async () => {
    const meta = policy ? `<meta http-equiv="content-security-policy" content="${policy}" />` : "";
    const server = await pageWith(html(`${meta}<script type="module">${BY_TAG}</script>`), headers);
    await opens(server.origin);
    await server.close();
  });
}

test("scripts without the header of an isolated page are refused with what to do", { timeout: SLOW_MS }, async () => {
  const bare = await pageWith(html(`<script type="module">${BY_TAG}</script>`));
  const isolated = createServer(async ({ url }, response) => {
    const answer = await fetch(bare.origin + url);
    const headers = url === "/" ? ISOLATED : {};
    response.writeHead(answer.status, { "content-type": answer.headers.get("content-type"), ...headers });
    response.end(Buffer.from(await answer.arrayBuffer()));
  }).listen(0, "127.0.0.1");
  await once(isolated, "listening");
  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${isolated.address().port}/`);
  await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
  const { code, failed } = await page.evaluate(() => globalThis.outcome);
  assert.equal(code, "engine-load");
  assert.match(failed, /send Cross-Origin-Embedder-Policy with the package's scripts too/);
  await page.close();
  isolated.close();
  await bare.close();
});

test("the packed package works in a sandboxed frame, which has no storage and no origin", { timeout: SLOW_MS }, async () => {
  const script = BY_TAG.replace(/globalThis.outcome = .*/, 'run().catch(told).then((outcome) => parent.postMessage(outcome, "*"));');
  const inner = await pageWith(html(`<script type="module">${script}</script>`), { "access-control-allow-origin": "*" });
  const frame = `<iframe sandbox="allow-scripts" src="${inner.origin}/"></iframe>`;
  const outer = await pageWith(html(`<script>addEventListener("message", ({ data }) => (globalThis.outcome = data))</script>${frame}`));
  await opens(outer.origin);
  await Promise.all([inner.close(), outer.close()]);
});

test("a worker, or an engine, of another version is refused with what to do", { timeout: SLOW_MS }, async () => {
  const dist = join(folder, "node_modules", "deepsft", "dist");
  const { version } = JSON.parse(await readFile(join(WWW, "package.json"), "utf8"));
  const other = join(folder, "cdn", "other");
  const again = "Copy the package's folder dist anew.";
  const renamed = (bytes) => Buffer.from(bytes.toString("latin1").replaceAll(version, "9.8.7"), "latin1");
  // The last: a module that is none of ours.
  for (const [name, change, message] of [
    ["worker.js", renamed, `The page runs deepsft ${version}, its worker is of 9.8.7. ${again}`],
    ["deepsft_web_bg.wasm", renamed, `The engine is of deepsft 9.8.7, its worker of ${version}. ${again}`],
    ["deepsft_web_bg.wasm", () => Buffer.from("\0asm\x01\0\0\0", "latin1"), /^The engine does not fit its worker .* Copy the package's folder dist anew\.$/],
  ]) {
    await cp(dist, other, { recursive: true });
    await writeFile(join(other, name), change(await readFile(join(dist, name))));
    const server = await pageWith(html(`<script type="module">import { DeepSft } from "/deepsft/deepsft.js";
      DeepSft.load(null, { baseUrl: "${cdn.origin}/other" }).catch(({ code, message }) => (globalThis.outcome = { code, message }));</script>`));
    const page = await browser.newPage();
    await page.goto(`${server.origin}/`);
    await page.waitForFunction(() => globalThis.outcome, undefined, { timeout: SLOW_MS });
    const outcome = await page.evaluate(() => globalThis.outcome);
    assert.equal(outcome.code, "engine-load");
    if (message instanceof RegExp) assert.match(outcome.message, message);
    else assert.equal(outcome.message, message);
    await page.close();
    await server.close();
  }
});
