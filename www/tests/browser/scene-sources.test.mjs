// What a scene looks at besides a video: a photograph, and a camera that looks at the person.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { SLOW_MS, launch } from "../support/browser.mjs";
import { decodePng } from "../support/png.mjs";
import { colorAt, isGreen, isMagenta, openScene, shownSheet } from "../support/scenes.mjs";

let clip;
let sheet;
let browser;
before(
  async () => {
    ({ clip, sheet } = await shownSheet());
    browser = await launch({ webgpu: false, testCameras: 1 });
  },
  { timeout: SLOW_MS },
);
after(() => browser?.close());

const onScene = (body) => openScene(browser, { shown: clip, hand: [0, 0] }, body);

/** Checks that the left half of the print is magenta, its right one green. */
function checkHalves(picture, isMirrored = false) {
  for (const [u, is] of [[0.2, isMagenta], [0.35, isMagenta], [0.65, isGreen], [0.8, isGreen]]) {
    const color = colorAt(picture, sheet, sheet.at(u, 0.5), isMirrored);
    assert.ok(is(color), `${color} at u = ${u}`);
  }
}

test("a photograph is shown with what is printed on its sheet, and drawn anew when that changes", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, shot }) => {
    await page.evaluate(async (png) => {
      const photograph = new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))], { type: "image/png" });
      globalThis.ar = await startScene({ source: undefined, photograph });
      const screen = (count) => new Promise((resolve) => requestAnimationFrame(() => (count > 1 ? screen(count - 1).then(resolve) : resolve())));
      await new Promise((resolve) => ar.addEventListener("found", resolve));
      // It is drawn as it is first.
      await screen(5);
      await ar.sheet().print(halves());
      ar.refresh();
      await screen(5);
    }, clip.frames[0].png.toString("base64"));
    checkHalves(await shot("photograph"));
    assert.equal(await page.getAttribute("#ar > div", "data-deepsft"), "running");
    assert.equal(await page.evaluate(() => ar.stream), null, "no camera is asked for");
    await page.evaluate(() => ar.close());
  }),
);

test("the picture of a camera that looks at the person is mirrored with all that is in it, and what is kept is not", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, shot }) => {
    const png = await page.evaluate(async (png) => {
      const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))]));
      MediaDevices.prototype.getUserMedia = async () => {
        const canvas = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
        setInterval(() => canvas.getContext("2d").drawImage(picture, 0, 0), 60);
        const stream = canvas.captureStream(15);
        const [track] = stream.getTracks();
        const { getSettings } = track;
        track.getSettings = () => ({ ...getSettings.call(track), facingMode: "user" });
        return stream;
      };
      globalThis.ar = await startScene({ source: undefined, facing: "user" });
      await until(() => ar.sheet().visible);
      await ar.sheet().print(halves());
      await drawn(ar, 6);
      return [...new Uint8Array(await (await ar.shot()).arrayBuffer())];
    }, clip.frames[0].png.toString("base64"));
    checkHalves(await shot("mirrored"), true);
    checkHalves(decodePng(Buffer.from(png)));
    await page.evaluate(() => ar.close());
  }),
);
