// The three programs of www/README.md as they stand there, the same in A-Frame, and a page without one, from dist/ without a bundler, in
// three browser engines, before a camera that shows a printed page.

import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";

import { makeClip } from "../support/clips.mjs";
import { ENGINES, PATIENCE_MS, closeScreen, openEngine } from "../support/engines.mjs";
import { MODEL } from "../support/native.mjs";
import { decodePng } from "../support/png.mjs";
import { NAMES, aframePages, readmePrograms, servePrograms, turningBox } from "../support/programs.mjs";
import { TrueSheet, inPose } from "../support/true-sheet.mjs";
import { WWW } from "../../serve.mjs";

const TEST_MS = 600_000;
const SCREENSHOTS = join(WWW, "tests", "screenshots");
/** The scene is 640 x 360 pixels large, the camera's picture 960 x 540. */
const SCALE = 640 / 960;
/** Of a page that is 210 mm wide the print is 297 / 210 as wide as the programs say, and a box of 60 mm as much larger. */
const LARGER = 297 / 210;
const BOX_M = 0.06;

let clip;
let sheet;
let server;

before(
  async () => {
    clip = await makeClip({ event: "motion", frames: 1, seed: 9_700_049, scale: 2 });
    sheet = new TrueSheet(clip.frames[0].vertices, clip.camera);
    const [print, film] = await Promise.all([join(MODEL, "template", "texture.png"), join(WWW, "demo", "clip.webm")].map((path) => readFile(path)));
    server = await servePrograms({ "camera.png": clip.frames[0].png, "poster.jpg": print, "page.jpg": print, "film.mp4": film, "dragon.glb": turningBox(BOX_M) });
    await mkdir(SCREENSHOTS, { recursive: true });
  },
  { timeout: TEST_MS },
);
after(async () => {
  await server?.close();
  await closeScreen();
});

/** What of a picture of the page shows a pixel of the camera's. */
function colorAt({ width, channels, values }, pixel) {
  const [x, y] = pixel.slice(0, 2).map((value) => Math.floor(value * SCALE));
  return [...values.subarray(channels * (y * width + x), channels * (y * width + x) + 3)];
}
const colorOf = (picture, point) => colorAt(picture, sheet.project(point));

/** The camera's picture there. */
function cameraColorAt(pixel) {
  const { width, rgb } = clip.frames[0].picture;
  const [x, y] = pixel.map(Math.floor);
  return [...rgb.subarray(3 * (y * width + x), 3 * (y * width + x) + 3)];
}
const cameraColorOf = (point) => cameraColorAt(sheet.project(point));

const isOther = (a, b) => a.some((value, k) => Math.abs(value - b[k]) > 30);
const isPink = ([r, g, b]) => r > 1.5 * g && r > 1.2 * b;

/** On the print, (u, v). */
const PLACES = [0.1, 0.3, 0.5, 0.7, 0.9].flatMap((u) => [0.15, 0.38, 0.62, 0.85].map((v) => [u, v]));
/** How many of them the page shows as something else than the camera does. */
const others = (picture) => PLACES.filter((place) => isOther(colorOf(picture, sheet.at(...place)), cameraColorOf(sheet.at(...place)))).length;

/** Pixels of the camera beside the print. */
const BESIDE = [[20, 20], [940, 20], [20, 520], [940, 520]];
/** Whether the camera's picture is seen beside the print. */
const isBehind = (picture) => BESIDE.every((pixel) => !isOther(colorAt(picture, pixel), cameraColorAt(pixel)));

/** What is missing on a page until each program does what it says, by a picture of it. @type {Record<string, (page: object, picture: object) => Promise<string | null>>} */
const MISSING = {
  async film(page, picture) {
    const plays = await page.run(() => [...document.querySelectorAll("#ar video, deepsft-view video, a-scene video")].some((video) => video.src.endsWith("film.mp4") && video.currentTime > 0.2 && !video.paused));
    if (!plays) return "the film does not play";
    if (!isBehind(picture)) return "the camera's picture is not behind it";
    return others(picture) > 0.6 * PLACES.length ? null : `${others(picture)} of ${PLACES.length} places show something else than the print`;
  },
  tag: (page, picture) => MISSING.film(page, picture),
  async object(_, picture) {
    const top = colorOf(picture, inPose(sheet.pose(0.5, 0.5), [0, 0.8 * 1000 * BOX_M * LARGER, 0]));
    if (!isBehind(picture)) return "the camera's picture is not behind it";
    if (!isPink(top)) return `${top} where the box is`;
    return others(picture) < 0.5 * PLACES.length ? null : `${others(picture)} of ${PLACES.length} places are not as the camera sees them`;
  },
  async measure(page) {
    const title = await page.run(() => document.title);
    const [, degrees] = /^bent by (\d+)°$/.exec(title) ?? [];
    return degrees > 0 && degrees < 90 ? null : `the title is "${title}"`;
  },
};

for (const name of ["film", "object", "measure"]) MISSING[`aframe-${name}`] = MISSING[name];

test("each of the programs has at most 12 lines", () => {
  for (const [name, text] of Object.entries({ ...readmePrograms(), ...aframePages() })) assert.ok(text.trim().split("\n").length <= 12, name);
});

for (const engine of ENGINES) {
  describe(engine, { concurrency: 1 }, () => {
    let page;
    before(async () => (page = await openEngine(engine)), { timeout: TEST_MS });
    after(() => page?.close());

    const run = async (name) => {
      await page.open(`${server.origin}/program/${name}.html`);
      const end = performance.now() + PATIENCE_MS;
      let png, missing;
      do {
        await new Promise((resolve) => setTimeout(resolve, 1000));
        png = await page.screenshot();
        missing = await MISSING[name](page, decodePng(png));
      } while (missing && performance.now() < end);
      await writeFile(join(SCREENSHOTS, `program-${name}-${engine}.png`), png);
      assert.deepEqual([missing, await page.run(() => errors)], [null, []]);
      // The next page opens the camera anew.
      await page.run(() => tracks.forEach((track) => track.stop()));
    };

    for (const name of NAMES) {
      test(`the program "${name}" does what it says`, { timeout: TEST_MS }, async () => {
        try {
          await run(name);
        } catch (error) {
          // WebKit on Linux was seen to end in an assertion of its own ("invalid opcode" in its library) while a screenshot was taken.
          if (error.name !== "NoSuchSessionError") throw error;
          await page.close();
          page = await openEngine(engine);
          await run(name);
        }
      });
    }
  });
}
