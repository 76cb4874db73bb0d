// Three browser engines behind one small interface: Chromium by Playwright, Firefox by Puppeteer (WebDriver BiDi), WebKit by
// WebDriver. Firefox and WebKit have windows, on a screen that nobody sees.

import { spawn } from "node:child_process";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";
import { Builder, By } from "selenium-webdriver";

import { launch as launchChromium } from "./browser.mjs";

const FIREFOX = process.env.DEEPSFT_FIREFOX ?? "/usr/bin/firefox-esr";
const WEBKIT_DRIVER = process.env.DEEPSFT_WEBKIT_DRIVER ?? "/usr/bin/WebKitWebDriver";
const XVFB = process.env.DEEPSFT_XVFB ?? "/usr/bin/Xvfb";

const WINDOW = { width: 1000, height: 700 };
/** A browser on a busy machine takes so long for what it does at once elsewhere, milliseconds. */
export const PATIENCE_MS = Number(process.env.DEEPSFT_ENGINE_PATIENCE_MS ?? 120_000);
const POLL_MS = 100;

/**
 * A page in a browser.
 *
 * @typedef {object} EnginePage
 * @property {string} version of the browser
 * @property {(url: string) => Promise<unknown>} open
 * @property {(body: Function, ...args: unknown[]) => Promise<any>} run a function on the page, with values that are JSON
 * @property {(selector: string) => Promise<unknown>} click
 * @property {(selector: string, file: string) => Promise<unknown>} choose a file, as a person does in the browser's dialogue
 * @property {() => Promise<Buffer>} screenshot PNG
 * @property {() => Promise<unknown>} close
 */

/**
 * @typedef {object} EngineOptions
 * @property {boolean} [webgl] false: a browser that offers none
 * @property {"shows" | "denied" | "none"} [camera] `shows`: the browser's own test camera, a moving pattern; WebKit cannot deny it
 */

/** @type {Record<string, (options: EngineOptions) => Promise<EnginePage>>} */
const LAUNCH = { chromium, firefox, webkit };

export const ENGINES = (process.env.DEEPSFT_ENGINES ?? Object.keys(LAUNCH).join(",")).split(",");

/**
 * @param {string} name of an engine
 * @param {EngineOptions} [options]
 */
export async function openEngine(name, { webgl = true, camera = "shows" } = {}) {
  const page = await LAUNCH[name]({ webgl, camera });
  return { ...page, until: (body, ...args) => until(page, body, args) };
}

/** Runs a function on the page until it returns something true. @param {EnginePage} page */
async function until(page, body, args) {
  const end = performance.now() + PATIENCE_MS;
  for (;;) {
    const value = await page.run(body, ...args);
    if (value) return value;
    if (performance.now() > end) {
      const said = await page.run(() => `${document.querySelector("#state-text")?.textContent}; ${document.querySelector("#message")?.textContent}`);
      throw new Error(`for ${PATIENCE_MS / 1000} s not: ${body}; the page says: ${said}`);
    }
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

async function chromium({ webgl, camera }) {
  const browser = await launchChromium({ webgpu: false, webgl, testCameras: camera === "none" ? 0 : 1 });
  const context = await browser.newContext({ viewport: WINDOW, permissions: camera === "denied" ? [] : ["camera"] });
  const page = await context.newPage();
  return {
    version: browser.version(),
    open: (url) => page.goto(url),
    run: (body, ...args) => page.evaluate(`(${body})(...${JSON.stringify(args)})`),
    click: (selector) => page.click(selector),
    choose: (selector, file) => page.setInputFiles(selector, file),
    screenshot: () => page.screenshot({ timeout: PATIENCE_MS }),
    close: () => browser.close(),
  };
}

async function firefox({ webgl, camera }) {
  const browser = await puppeteer.launch({
    browser: "firefox",
    executablePath: FIREFOX,
    headless: false,
    defaultViewport: WINDOW,
    timeout: PATIENCE_MS,
    protocolTimeout: PATIENCE_MS,
    env: { ...process.env, DISPLAY: await screen() },
    extraPrefsFirefox: {
      "webgl.force-enabled": webgl,
      "webgl.disabled": !webgl,
      "media.navigator.streams.fake": camera !== "none",
      "permissions.default.camera": camera === "denied" ? 2 : 1,
    },
  });
  const [page] = await browser.pages();
  return {
    version: (await browser.version()).replace(/^\D*/, ""),
    open: (url) => page.goto(url),
    run: (body, ...args) => page.evaluate(`(${body})(...${JSON.stringify(args)})`),
    click: (selector) => page.click(selector),
    choose: async (selector, file) => (await page.$(selector)).uploadFile(file),
    screenshot: async () => Buffer.from(await page.screenshot()),
    close: () => browser.close(),
  };
}

async function webkit({ webgl, camera }) {
  const port = await freePort();
  // A home of its own, so that nothing of the last visit is kept.
  const home = await mkdtemp(join(tmpdir(), "deepsft-webkit-"));
  const env = { ...process.env, DISPLAY: await screen(), HOME: home, XDG_DATA_HOME: home, XDG_CACHE_HOME: home, XDG_CONFIG_HOME: home };
  const service = spawn(WEBKIT_DRIVER, [`--port=${port}`], { env, stdio: "ignore" });
  const failed = new Promise((_, reject) => service.once("error", reject));
  const args = [
    "--automation",
    "--enable-media-stream=true",
    `--enable-webgl=${webgl}`,
    ...(camera === "none" ? [] : ["--enable-mock-capture-devices=true"]),
  ];
  await Promise.race([answers(port), failed]);
  const driver = await new Builder()
    .usingServer(`http://127.0.0.1:${port}`)
    .withCapabilities({ browserName: "MiniBrowser", "webkitgtk:browserOptions": { args } })
    .build();
  await driver.manage().setTimeouts({ script: PATIENCE_MS, pageLoad: PATIENCE_MS });
  await driver.manage().window().setRect(WINDOW);
  const capabilities = await driver.getCapabilities();
  return {
    version: capabilities.get("browserVersion"),
    open: (url) => driver.get(url),
    run: async (body, ...args) => {
      const script = `const done = arguments[arguments.length - 1];
        Promise.resolve().then(() => (${body})(...arguments[0])).then((value) => done({ value }), (error) => done({ error: String(error) }))`;
      const { value, error } = await driver.executeAsyncScript(script, args);
      if (error) throw new Error(error);
      return value;
    },
    click: async (selector) => (await driver.findElement(By.css(selector))).click(),
    choose: async (selector, file) => (await driver.findElement(By.css(selector))).sendKeys(file),
    screenshot: async () => Buffer.from(await driver.takeScreenshot(), "base64"),
    close: async () => {
      await driver.quit().catch(() => undefined);
      service.kill();
      await rm(home, { recursive: true, force: true, maxRetries: 5 });
    },
  };
}

/** @type {Promise<{ display: string, stop: () => void }> | null} */
let shown = null;

/** A screen that nobody sees, for windows. @returns {Promise<string>} its name */
async function screen() {
  shown ??= new Promise((resolve, reject) => {
    const server = spawn(XVFB, ["-displayfd", "1", "-screen", "0", "1280x900x24", "-nolisten", "tcp"], { stdio: ["ignore", "pipe", "ignore"] });
    server.once("error", reject);
    server.once("exit", (code) => reject(new Error(`${XVFB} ended with ${code}`)));
    server.stdout.once("data", (number) => resolve({ display: `:${String(number).trim()}`, stop: () => server.kill() }));
  });
  return (await shown).display;
}

/** Ends the screen. */
export async function closeScreen() {
  (await shown)?.stop();
  shown = null;
}

async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { port } = /** @type {import("node:net").AddressInfo} */ (server.address());
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** Resolves when a WebDriver server answers. */
async function answers(port) {
  const end = performance.now() + PATIENCE_MS;
  for (;;) {
    try {
      return await fetch(`http://127.0.0.1:${port}/status`);
    } catch (error) {
      if (performance.now() > end) throw error;
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
  }
}
