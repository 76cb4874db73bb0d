// Chromium, a page of the demo in it, and what every test wants to know about both.

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

import { WWW, serve } from "../../serve.mjs";

// Imported, each file of tests would take twice as long to have it: Node.js then searches all of it for the names that it exports.
/** @type {import("playwright-core")} */
const { chromium } = createRequire(import.meta.url)("playwright-core");

/** The program, from `cargo xtask test` or Debian's, and its flags: a software WebGPU adapter, so that results do not depend on the machine. */
const PROGRAM = process.env.DEEPSFT_CHROMIUM ?? "/usr/bin/chromium";
const FLAGS = JSON.parse(process.env.DEEPSFT_CHROMIUM_FLAGS ?? "null") ?? [
  "--headless=new",
  "--no-sandbox",
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-unsafe-swiftshader",
];
const WEBGPU_FLAGS = /webgpu/i;

/** A software GPU on a machine that does other things takes seconds for a frame, and longer for the first. */
export const SLOW_MS = 600_000;

export const DESKTOP = { viewport: { width: 1440, height: 900 } };
export const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true };

/** The empty page's address on the site. */
export const BLANK = "/tests/support/blank.html";

const SCREENSHOTS = join(WWW, "tests", "screenshots");

/**
 * @typedef {object} LaunchOptions
 * @property {boolean} [webgpu] whether there is an adapter
 * @property {boolean} [webgl] whether there is WebGL
 * @property {number} [testCameras] how many cameras there are that show the browser's own moving pattern
 * @property {string} [camera] a .y4m file that the camera shows; no camera without
 */

/** How the browser starts, for those who start it themselves. @param {LaunchOptions} options */
export function startOptions({ webgpu = true, webgl = true, testCameras = 0, camera }) {
  // A software GPU on a busy machine is slow, not hung.
  const args = [...FLAGS.filter((flag) => webgpu || !WEBGPU_FLAGS.test(flag)), "--disable-gpu-watchdog", "--process-per-site"];
  if (!webgpu) args.push("--disable-features=WebGPU", "--disable-gpu");
  if (!webgl) args.push("--disable-3d-apis");
  if (testCameras > 0) args.push(`--use-fake-device-for-media-stream=device-count=${testCameras}`);
  if (camera) args.push("--use-fake-device-for-media-stream", `--use-file-for-fake-video-capture=${camera}`);
  return { executablePath: PROGRAM, args, ignoreDefaultArgs: ["--headless"], timeout: 60_000 };
}

/** Times that a browser is started: Chromium now and then ends within its first second, before any test has begun. */
const ATTEMPTS = 3;

/** A browser that nobody has for so long ends, milliseconds: until then the next test may want it. */
const LINGER_MS = 2000;

/** Browsers by their options, with how many have them. @type {Map<string, { browser: Promise<import("playwright-core").Browser>, users: number, end?: NodeJS.Timeout }>} */
const lent = new Map();

/**
 * A browser, one for all who want the same options: to start one takes a second of the processor. `close` gives it back, and ends what was
 * opened in it meanwhile.
 *
 * @param {LaunchOptions} [options]
 */
export async function launch(options = {}) {
  const key = JSON.stringify(options);
  const entry = lent.get(key) ?? { browser: start(options), users: 0 };
  lent.set(key, entry);
  clearTimeout(entry.end);
  entry.users++;
  const browser = await entry.browser.catch((error) => {
    lent.delete(key);
    throw error;
  });
  if (!contexts.has(browser)) {
    contexts.set(browser, new Map());
    // One that has crashed is lent no more.
    browser.on("disconnected", () => lent.get(key) === entry && lent.delete(key));
  }
  const end = browser.constructor.prototype.close;
  browser.close = async () => {
    if (--entry.users > 0) return;
    const [kept, others] = [sharedContexts(browser), browser.contexts()];
    for (const context of others) {
      if (!kept.has(context)) await context.close();
      else await Promise.all(context.pages().filter((page) => page !== kept.get(context)).map((page) => page.close()));
    }
    entry.end = setTimeout(() => {
      lent.delete(key);
      void end.call(browser);
    }, LINGER_MS);
  };
  return browser;
}

/** @param {LaunchOptions} options */
async function start(options) {
  for (let attempt = 1; ; attempt++) {
    /** @type {import("playwright-core").Browser | undefined} */
    let browser;
    try {
      browser = await chromium.launch(startOptions(options));
      await (await browser.newContext()).close();
      return browser;
    } catch (error) {
      await browser?.close().catch(() => undefined);
      if (attempt === ATTEMPTS) throw error;
    }
  }
}

/** Contexts that tests share, by browser and device, and the page of each that keeps the engine's code. */
const contexts = new WeakMap();

/** @returns {Map<import("playwright-core").BrowserContext, import("playwright-core").Page>} */
const sharedContexts = (browser) => new Map([...(contexts.get(browser)?.values() ?? [])].map(({ context, keeper }) => [context, keeper]));

/**
 * A context of a browser, the same for all who want the same device. What a page stores and may do is its origin's, and each server has
 * another: so pages of tests know nothing of one another.
 *
 * @param {import("playwright-core").Browser} browser
 * @param {object} device
 * @returns {Promise<import("playwright-core").BrowserContext>}
 */
export async function contextOf(browser, device) {
  const key = JSON.stringify(device);
  const ofBrowser = contexts.get(browser);
  if (!ofBrowser.has(key)) {
    const context = await browser.newContext(device);
    context.setDefaultTimeout(SLOW_MS);
    ofBrowser.set(key, { context, keeper: await keepCompiled(context) });
    context.on("close", () => ofBrowser.delete(key));
  }
  return ofBrowser.get(key).context;
}

/**
 * Opens a page that holds the engine's module. All pages of a context run in one process (`--process-per-site`), in which Chromium then has
 * the module's code, with what was optimised of it: to compile it takes two seconds of the processor, each time.
 *
 * @param {import("playwright-core").BrowserContext} context
 * @returns {Promise<import("playwright-core").Page>}
 */
export async function keepCompiled(context) {
  const server = await serve();
  try {
    const page = await context.newPage();
    await page.goto(server.origin + BLANK);
    await page.evaluate(async () => {
      globalThis.kept = await WebAssembly.compileStreaming(fetch("/dist/deepsft_web_bg.wasm"));
    });
    return page;
  } finally {
    await server.close();
  }
}

/**
 * The browser with tabs that hide one another, as a person's do: Playwright has each of its pages believe that it is in front.
 *
 * @param {LaunchOptions} options
 */
export async function launchWithTabs(options) {
  const { executablePath, args, timeout } = startOptions(options);
  const hiding = ["--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--disable-background-timer-throttling"];
  // Permissions that Puppeteer gives are all that a page has then.
  args.push("--use-fake-ui-for-media-stream");
  // Few tests need it.
  const { default: puppeteer } = await import("puppeteer-core");
  return puppeteer.launch({ executablePath, args, timeout, ignoreDefaultArgs: hiding, protocolTimeout: SLOW_MS });
}

/**
 * The browser with a folder in which it keeps what it would keep of a person's visits: files, and code that it has compiled.
 *
 * @param {string} folder
 * @param {LaunchOptions & import("playwright-core").BrowserContextOptions} options
 */
export async function launchWithProfile(folder, { webgpu, camera, ...context }) {
  return chromium.launchPersistentContext(folder, { ...startOptions({ webgpu, camera }), ...context });
}

/** Pages of {@link openDemo} that have not finished. @type {WeakMap<object, Set<import("playwright-core").Page>>} */
const unfinished = new WeakMap();

/** Closes the pages that failed tests have left: they would follow their sheets beside the next. */
async function closeUnfinished(browser) {
  for (const page of unfinished.get(browser) ?? []) await page.close();
  unfinished.set(browser, new Set());
}

/**
 * The demo page, at an origin of its own. One at a time in a browser. Each request to another origin, each error on the console and each exception
 * fails the test that calls `finish`.
 *
 * @param {import("playwright-core").Browser} browser
 * @param {object} [options]
 * @param {object} [options.device] DESKTOP or PHONE
 * @param {string} [options.query] such as "?device=cpu"
 * @param {Record<string, string>} [options.folders] that are served, in place of the development server's
 * @param {string} [options.path] where the page is in them
 * @param {string[]} [options.permissions]
 * @param {RegExp[]} [options.expectedErrors] console errors that belong to the test
 * @param {(page: import("playwright-core").Page) => Promise<void>} [options.prepare] before the page is loaded
 */
export async function openDemo(
  browser,
  { device = DESKTOP, query = "", folders, path = "/", permissions = [], expectedErrors = [], prepare } = {},
) {
  const server = await serve({ folders });
  await closeUnfinished(browser);
  const context = await contextOf(browser, device);
  if (permissions.length > 0) await context.grantPermissions(permissions, { origin: server.origin });
  const page = await context.newPage();
  unfinished.get(browser)?.add(page);
  const requests = [];
  const problems = [];
  page.on("request", (request) => requests.push(request.url()));
  page.on("console", (message) => {
    if (message.type() === "error" && !expectedErrors.some((known) => known.test(message.text())))
      problems.push(message.text());
  });
  page.on("pageerror", (error) => problems.push(String(error)));
  await prepare?.(page);
  await page.goto(server.origin + path + query);
  return {
    page,
    context,
    origin: server.origin,
    /** @param {string} name */
    async screenshot(name) {
      mkdirSync(SCREENSHOTS, { recursive: true });
      await page.screenshot({ path: join(SCREENSHOTS, `${name}.png`), timeout: SLOW_MS });
    },
    async finish() {
      const foreign = requests.filter((url) => !/^(data|blob):/.test(url) && new URL(url).origin !== server.origin);
      await page.close();
      unfinished.get(browser)?.delete(page);
      await server.close();
      assert.deepEqual(foreign, [], "requests that left the page's origin");
      assert.ok(requests.length > 5, "requests were watched");
      assert.deepEqual(problems, [], "errors on the page");
    },
  };
}

/**
 * Waits for the card that says what is in the way.
 *
 * @param {import("playwright-core").Page} page
 * @returns {Promise<{ code: string, title: string, detail: string }>}
 */
export async function messageOf(page) {
  await page.waitForSelector("#message[open]");
  const text = (selector) => page.locator(selector).textContent();
  return {
    code: await text("#message-code"),
    title: await text("#message-title"),
    detail: await text("#message-detail"),
  };
}
