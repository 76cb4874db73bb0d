// A page with a scene of `deepsft/scene` that looks at a picture whose truth is known.

import assert from "node:assert/strict";

import { openDemo } from "./browser.mjs";
import { makeClip } from "./clips.mjs";
import { decodePng } from "./png.mjs";
import { TrueSheet } from "./true-sheet.mjs";

/** The scene is 640 x 360 pixels large, the clips' pictures 960 x 540. */
const SIZE = { width: 640, height: 360 };
const SCALE = 640 / 960;
/** A hand: a grey disc of so many pixels of the clip around its sheet's middle. */
export const HAND = 90;

/** A clip of one picture, and the sheet in it. */
export async function shownSheet() {
  const clip = await makeClip({ event: "motion", frames: 1, seed: 9_700_049, scale: 2 });
  return { clip, sheet: new TrueSheet(clip.frames[0].vertices, clip.camera) };
}

/** On the page: `scene`, the package; `source`, what it looks at: the picture, a hand before it (`source.hand`), or nothing (`source.grey`). */
async function prepare({ png, camera, place, hand }) {
  const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
  const picture = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
  const source = { hand: false, grey: false };
  async function* frames() {
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext("2d");
    for (let timeMs = 0; ; timeMs += 100) {
      context.drawImage(picture, 0, 0);
      context.fillStyle = "#808080";
      if (source.grey) context.fillRect(0, 0, canvas.width, canvas.height);
      if (source.hand) context.fill(new Path2D(`M${place[0] - hand} ${place[1]}a${hand} ${hand} 0 1 0 ${2 * hand} 0a${hand} ${hand} 0 1 0 ${-2 * hand} 0`));
      const frame = await createImageBitmap(canvas);
      yield { frame, timeMs };
      frame.close();
      await new Promise((resolve) => setTimeout(resolve, 60));
    }
  }
  const until = async (isSo) => {
    while (!(await isSo())) await new Promise((resolve) => setTimeout(resolve, 50));
  };
  const drawn = (ar, count) => new Promise((resolve) => ar.addEventListener("frame", () => count-- === 0 && resolve()));
  /** Magenta on the left, green on the right. */
  const halves = () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
    const pen = canvas.getContext("2d");
    for (const [i, color] of ["#e040e0", "#40e040"].entries()) Object.assign(pen, { fillStyle: color }).fillRect(32 * i, 0, 32, 64);
    return canvas;
  };
  const errors = [];
  addEventListener("error", ({ message }) => errors.push(message));
  addEventListener("unhandledrejection", ({ reason }) => errors.push(String(reason)));
  Object.assign(globalThis, { source, until, drawn, halves, errors, scene: await import("deepsft/scene"), three: await import("three") });
  globalThis.startScene = (options) => scene.start("#ar", { picture: "/models/poster-a4/template/texture.png", widthMm: 297, source: frames(), camera, ...options });
}

/**
 * @param {import("playwright-core").Browser} browser
 * @param {{ shown: object, hand: number[] }} source the clip whose first picture is shown, and where a hand lies, its pixels
 * @param {(shown: { page: import("playwright-core").Page, shot: (name?: string) => Promise<object>, demo: object }) => Promise<void>} body
 * @param {object} [options] of `openDemo`
 */
export async function openScene(browser, { shown, hand }, body, options = {}) {
  const demo = await openDemo(browser, { path: "/tests/support/scene.html", device: { viewport: SIZE }, ...options });
  const { page } = demo;
  try {
    await page.evaluate(prepare, { png: shown.frames[0].png.toString("base64"), camera: shown.camera, place: hand, hand: HAND });
    const shot = async (name) => {
      if (name) await demo.screenshot(`scene-${name}`);
      return decodePng(await page.screenshot());
    };
    await body({ page, shot, demo });
    assert.deepEqual(await page.evaluate(() => errors), []);
  } finally {
    await demo.finish();
  }
}

/** The colour where the scene shows a point of the clip's camera frame, or mirrored. */
export function colorAt({ width, channels, values }, sheet, point, isMirrored = false) {
  const [x, y] = sheet.project(point).slice(0, 2).map((value) => Math.floor(value * SCALE));
  const at = channels * (y * width + (isMirrored ? width - 1 - x : x));
  return [...values.subarray(at, at + 3)];
}

export const isMagenta = ([r, g, b]) => r > 1.4 * g && b > 1.4 * g;
export const isGreen = ([r, g, b]) => g > 1.4 * r && g > 1.4 * b;
