// The demo page while its camera shows the poster, and what can befall it: a permission withdrawn, a phone turned, a tab hidden, a
// worker that crashes, a GPU lost.

import { writeFile } from "node:fs/promises";
import { join } from "node:path";

import { makeClip } from "./clips.mjs";
import { destroyerOfDevices, footprintOf, launchToMeasure } from "./footprint.mjs";
import { y4m } from "./y4m.mjs";
import { serve } from "../../serve.mjs";

/** A page that shows nothing new for so long counts as stopped, milliseconds. */
const PATIENCE_MS = 180_000;
const POLL_MS = 200;
/** When nothing has come for so long, nothing is on its way, milliseconds: an emulated GPU takes seconds for an answer. */
const QUIET_MS = { cpu: 1500, webgpu: 8000 };
/** A worker that takes so long to come to a message has been computing, milliseconds. */
const BUSY_MS = 500;
/** A small one: on a machine without a GPU the processor draws it. */
const WINDOW = { width: 640, height: 400 };

/** Clips have seeds from 9,000,000 on; these are the soak's own. */
const SEED = 9_700_061;
/** 960 x 540 pixels. */
const SCALE = 2;

/**
 * A film of the poster for the browser's camera.
 *
 * @param {string} folder to work in
 * @param {string[]} events what happens in it, one scene each
 * @param {number} frames of each scene
 * @param {number} perSecond
 * @returns {Promise<string>} the file
 */
export async function posterFilm(folder, events, frames, perSecond) {
  const pictures = [];
  for (const [i, event] of events.entries()) {
    const clip = await makeClip({ event, frames, seed: SEED + i, scale: SCALE });
    pictures.push(...clip.frames.map(({ picture }) => picture));
  }
  const film = join(folder, "camera.y4m");
  await writeFile(film, y4m(pictures, perSecond));
  return film;
}

/** Waits until a worker has nothing else to do; one that has ended has not. @param {import("puppeteer-core").WebWorker} worker */
function idle(worker) {
  return worker.evaluate(() => new Promise((resolve) => setTimeout(resolve))).catch(() => undefined);
}

/** On the page: counts what it follows. */
function count() {
  const seen = { frames: 0, found: 0, answers: 0, upright: 0 };
  Object.assign(globalThis, { seen });
  document.addEventListener("deepsft-tracked", ({ tracked: { found, camera } }) => {
    seen.frames++;
    if (found) seen.found++;
    if (camera.height > camera.width) seen.upright++;
  });
  document.addEventListener("deepsft-estimate", () => seen.answers++);
}

export class FollowedPage {
  #browser;
  #server;
  #session;
  #quietMs;
  /** Errors that nobody expected. @type {string[]} */
  problems = [];

  /**
   * Use {@link FollowedPage.open}.
   *
   * @param {import("puppeteer-core").Browser} browser
   * @param {Awaited<ReturnType<typeof serve>>} server
   * @param {import("puppeteer-core").Page} page
   * @param {import("puppeteer-core").CDPSession} session of the browser
   * @param {"cpu" | "webgpu"} device
   */
  constructor(browser, server, page, session, device) {
    [this.#browser, this.#server, this.#session, this.#quietMs] = [browser, server, session, QUIET_MS[device]];
    this.page = page;
    page.on("pageerror", (error) => this.problems.push(String(error)));
    page.on("console", (message) => message.type() === "error" && this.problems.push(message.text()));
  }

  /**
   * Opens the page, its camera allowed.
   *
   * @param {{ camera: string, device: "cpu" | "webgpu", path?: string }} options
   */
  static async open({ camera, device, path = `/?device=${device}` }) {
    const server = await serve();
    const browser = await launchToMeasure({ webgpu: device === "webgpu", camera });
    const session = await browser.target().createCDPSession();
    const page = await browser.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    await page.setViewport(WINDOW);
    const followed = new FollowedPage(browser, server, page, session, device);
    await followed.permit("granted");
    await page.goto(server.origin + path);
    await page.evaluate(count);
    return followed;
  }

  /** Opens the camera, as a person does. */
  async start() {
    await this.page.click("#use-camera");
    await this.followsOn();
  }

  /** @returns {Promise<{ frames: number, found: number, answers: number, upright: number }>} so far */
  counts() {
    return this.page.evaluate(() => globalThis.seen);
  }

  /** What the page and its workers hold while nothing is on its way. */
  footprint() {
    return this.#atRest(() => footprintOf(this.page));
  }

  /**
   * Does something while the video stands still. (A worker that is computing takes Chromium down with it, now and then, when its objects
   * are looked through.)
   *
   * @template T
   * @param {() => Promise<T>} act
   * @returns {Promise<T>}
   */
  async #atRest(act) {
    const play = (/** @type {boolean} */ on) =>
      this.page.$$eval("video", (videos, on) => Promise.all(videos.map((video) => (on ? video.srcObject && video.play() : video.pause()))), on);
    await play(false);
    let [last, since] = ["", performance.now()];
    while (performance.now() - since < this.#quietMs) {
      const asked = performance.now();
      await Promise.all(this.page.workers().map(idle));
      const now = JSON.stringify(await this.counts());
      if (now !== last || performance.now() - asked > BUSY_MS) [last, since] = [now, performance.now()];
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
    const done = await act();
    await play(true);
    return done;
  }

  /** Waits until the counts are as `isEnough` wants them; fails when they stand still. @param {(counts: Awaited<ReturnType<FollowedPage["counts"]>>) => boolean} isEnough */
  async until(isEnough) {
    let [last, changed] = ["", performance.now()];
    for (;;) {
      const counts = await this.counts();
      if (isEnough(counts)) return counts;
      const now = JSON.stringify(counts);
      if (now !== last) [last, changed] = [now, performance.now()];
      else if (performance.now() - changed > PATIENCE_MS) throw new Error(`the page stands still at ${now}: ${await this.says()}`);
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
  }

  /** Waits for more frames in which the sheet is found, and for more answers of the network. */
  async followsOn({ found = 5, answers = 1 } = {}) {
    const before = await this.counts();
    await this.until((now) => now.found >= before.found + found && now.answers >= before.answers + answers);
  }

  /** What the page tells a person. */
  says() {
    return this.page.evaluate(() => {
      const text = (/** @type {string} */ id) => document.querySelector(id)?.textContent?.replace(/\s+/g, " ").trim();
      return `${text("#state-text")}; ${document.querySelector("#message")?.checkVisibility() ? text("#message") : "no message"}`;
    });
  }

  /** Waits for the card that says what is in the way. @returns {Promise<string>} its code */
  async message() {
    await this.page.waitForSelector("#message[open]");
    return this.page.$eval("#message-code", ({ textContent }) => textContent ?? "");
  }

  /** What a person decides about the camera, in the browser's own settings. @param {"granted" | "denied"} setting */
  async permit(setting) {
    await this.#session.send("Browser.setPermission", { permission: { name: "camera" }, setting, origin: this.#server.origin });
  }

  /** Turns the camera's picture, as a phone does that is turned: its track goes on with another size. @param {boolean} upright */
  async turn(upright) {
    await this.page.evaluate(async (upright) => {
      const video = /** @type {HTMLVideoElement} */ (document.querySelector("#video"));
      const [track] = /** @type {MediaStream} */ (video.srcObject).getVideoTracks();
      const { width: across, height: up } = track.getCapabilities();
      const [long, short] = [across?.max ?? 0, up?.max ?? 0];
      // Cameras give no more rows than they have: the upright picture is the middle of the other.
      await track.applyConstraints({ width: { exact: upright ? 2 * Math.round((short * short) / long / 2) : long }, height: { exact: short } });
    }, upright);
  }

  /** Lies behind another tab for some time. @returns {Promise<number>} frames that were followed there */
  async hide(/** @type {number} */ ms) {
    const other = await this.#browser.newPage();
    await other.bringToFront();
    await this.page.waitForFunction(() => document.visibilityState === "hidden", { polling: POLL_MS });
    const before = await this.counts();
    await new Promise((resolve) => setTimeout(resolve, ms));
    const after = await this.counts();
    await other.close();
    await this.page.bringToFront();
    return after.frames - before.frames;
  }

  /** Has each worker throw what nobody catches, and waits until it is gone. */
  async crash() {
    const workers = this.page.workers();
    for (const worker of workers) await worker.evaluate(() => void setTimeout(() => { throw new Error("crash"); }));
    while (this.page.workers().some((worker) => workers.includes(worker))) await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }

  /** Destroys the engine's GPU device while it works. */
  async loseGpu() {
    const destroy = await this.#atRest(() => destroyerOfDevices(this.page));
    const { answers } = await this.counts();
    await this.until((now) => now.answers > answers);
    if ((await destroy()) !== 1) throw new Error("there is no GPU device, or more than one");
  }

  async close() {
    await this.#browser.close();
    await this.#server.close();
  }
}
