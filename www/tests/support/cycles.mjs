// What a page does with the package again and again.

import { readFile } from "node:fs/promises";
import { join } from "node:path";

import { ROOT } from "../../serve.mjs";

/** On a page that {@link prepare} prepared. */
export const CYCLES = {
  /** Follows the sheet for some frames. */
  async trackings() {
    let frames = 0;
    for await (const { found } of globalThis.sft.follow(globalThis.video)) if (found && ++frames > 4) break;
  },

  /** Adds a picture, looks for it and lets it go. */
  async targets() {
    const target = await globalThis.sft.addPicture(globalThis.picture, { widthMm: 200 });
    const estimate = await globalThis.sft.estimate(globalThis.still, { target });
    if (!estimate.found) throw new Error("the picture is not found");
    estimate.close();
    globalThis.sft.removeTarget(target);
  },

  /** Looks at an image and completes the mesh. */
  async images() {
    const estimate = await globalThis.sft.estimate(globalThis.still);
    if (!estimate.found || !(await estimate.completeMesh())) throw new Error("the poster is not found");
    estimate.close();
  },
};

/** Gives an empty page an engine, the camera, and an image of the poster beside its mirror image. @param {import("puppeteer-core").Page} page */
export async function prepare(page) {
  const texture = await readFile(join(ROOT, "models", "poster-a4", "template", "texture.png"), "base64");
  await page.evaluate(async (texture) => {
    const { DeepSft, openCamera } = await import("/src/index.js");
    const sft = await DeepSft.load("/models/poster-a4/", { device: "cpu" });
    const video = document.body.appendChild(document.createElement("video"));
    await openCamera(video);
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(texture), (c) => c.charCodeAt(0))]));
    const { width, height } = bitmap;
    const canvas = (width, height) => new OffscreenCanvas(width, height).getContext("2d");
    const picture = canvas(width, height);
    picture.setTransform(-1, 0, 0, 1, width, 0);
    picture.drawImage(bitmap, 0, 0);
    const still = canvas(960, 540);
    still.fillStyle = "#777";
    still.fillRect(0, 0, 960, 540);
    for (const [i, image] of [bitmap, picture.canvas].entries()) still.drawImage(image, 40 + 450 * i, 110, 430, (430 * height) / width);
    bitmap.close();
    Object.assign(globalThis, { sft, video, picture: picture.canvas, still: still.canvas });
  }, texture);
}
