// The examples with three.js and the page's own object before a camera, judged by the pixels they draw and the truth of the clip that the
// camera shows.

import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { CANONICAL_FOCAL, canonicalSize, imageFromCanonical } from "deepsft";
import { OBJECTS } from "../../demo/objects/objects.js";
import { SCALE } from "../../demo/objects/standing.js";
import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { readStamp, stamp, stampPoints } from "../support/barcode.mjs";
import { makeClip } from "../support/clips.mjs";
import { median } from "../support/maps.mjs";
import { MODEL } from "../support/native.mjs";
import { decodePng } from "../support/png.mjs";
import { cornersOf, depthsOf, inner } from "../support/silhouettes.mjs";
import { TrueSheet, inPose } from "../support/true-sheet.mjs";
import { y4m } from "../support/y4m.mjs";

/** The sheet is seen some 30 degrees from its normal, so what stands on it and what is below it lie apart, and light fades across it. */
const SEED = 9_700_049;
const FRAMES = 30;
/** Grey frames at the film's end, when the scene is covered. */
const COVERED = 12;
/** A fifth of the rate that the clip is rendered for, as in tracking.test.mjs. */
const CAMERA_FPS = 6;
/** Pictures that are looked at of each example. */
const SHOTS = 3;

let folder;
let clip;
/** The true sheet in each frame of the clip. */
let sheets;
let browser;
/** Luminance of the poster, linear, by (u, v). */
let printed;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-three-"));
    clip = await makeClip({ event: "motion", frames: FRAMES, seed: SEED, scale: 2 });
    sheets = clip.frames.map(({ vertices }) => new TrueSheet(vertices, clip.camera));
    const copy = ({ picture }) => ({ ...picture, rgb: Uint8Array.from(picture.rgb) });
    const { width, height } = clip.camera;
    const grey = Array.from({ length: COVERED }, () => ({ width, height, rgb: new Uint8Array(3 * width * height).fill(110) }));
    const film = [...clip.frames.map(copy), ...clip.frames.toReversed().map(copy), ...grey];
    film.forEach((picture, i) => stamp(picture, i));
    const camera = join(folder, "camera.y4m");
    await writeFile(camera, y4m(film, CAMERA_FPS));
    const texture = decodePng(await readFile(join(MODEL, "template", "texture.png")));
    printed = meanOver(texture);
    browser = await launch({ webgpu: false, camera });
  },
  { timeout: SLOW_MS },
);
after(async () => {
  await browser?.close();
  await rm(folder, { recursive: true, force: true });
});

/** What of `frames`, one for each of the clip, belongs to a frame of the film; undefined while covered. */
const ofFilm = (frames, film) => frames[film < FRAMES ? film : 2 * FRAMES - 1 - film];

/** @returns {[number, number, number]} of a picture of three or four channels */
function colorAt({ width, channels, values }, x, y) {
  const at = channels * (y * width + x);
  return [values[at], values[at + 1], values[at + 2]];
}

const linear = (byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);

/** Mean luminance of a picture around a place of the unit square, as far as `half` to each side. */
function meanOver({ width, height, channels = 3, values }) {
  return (u, v, half) => {
    let [sum, count] = [0, 0];
    for (let y = Math.floor((v - half) * height); y < (v + half) * height; y += 2) {
      for (let x = Math.floor((u - half) * width); x < (u + half) * width; x += 2, count++)
        sum += luminance(colorAt({ width, channels, values }, x, y));
    }
    return sum / count;
  };
}

/** Whether a frame of the film comes long enough after the covered ones for the sheet to be found again, on a busy machine too. */
const isFollowed = (film) => film >= FRAMES && film < 2 * FRAMES;

/**
 * Opens an example before the camera, and gives pictures of it with the frame of the film that each shows.
 *
 * @param {string} name
 * @param {(shown: object) => Promise<void>} body given `shot`, a picture of the page; `next`, the next picture with a wanted frame
 *   of the film, the true sheet in it, and between which times of its first video it was taken; and `page`
 */
async function onExample(name, body) {
  const { width, height } = clip.camera;
  // The videos that it plays, in their order.
  const prepare = (context) =>
    context.addInitScript(() => {
      globalThis.played = [];
      const { play } = HTMLMediaElement.prototype;
      HTMLMediaElement.prototype.play = function () {
        played.push(this);
        return play.call(this);
      };
    });
  const demo = await openDemo(browser, { device: { viewport: { width, height } }, path: `/examples/${name}.html`, permissions: ["camera"], prepare });
  try {
    await demo.page.waitForSelector("p:empty", { state: "attached" });
    const seen = new Set();
    const shot = async () => decodePng(await demo.page.screenshot());
    // Where the first of its videos is, seconds.
    const time = () => demo.page.evaluate(() => played[0].currentTime);
    const next = async (wanted) => {
      const until = Date.now() + SLOW_MS / 2;
      while (Date.now() < until) {
        const from = await time();
        const picture = await shot();
        const film = readStamp(stampPoints(height).map(([x, y]) => colorAt(picture, x, y)[1]));
        if (seen.has(film) || !wanted(film)) continue;
        seen.add(film);
        if (seen.size === 1) await demo.screenshot(`three-${name}`);
        return { film, picture, sheet: ofFilm(sheets, film), from, until: await time() };
      }
      throw new Error("the film does not show what is waited for");
    };
    await body({ next, shot, page: demo.page });
  } finally {
    await demo.finish();
  }
}

/** The ring's axis lies along the sheet, half of it is below; the ball stands in it. In mm, as in the example. */
const RING = { radius: 50, tube: 7 };
const BALL = { radius: 18, height: 18 };
/** What is so little before the sheet or behind it may be seen or not, mm: so far the tracker errs. */
const NEAR_MM = 4;
/** Darker in green than anything on the poster that is as pink. */
const isRing = ([r, g, b]) => r > 110 && g < 0.2 * r && b > 0.4 * r && b < 0.85 * r;

/** Which pixels show the ring, and which would if the sheet did not hide it: by the truth. */
function trueRing(sheet) {
  const { width, height } = clip.camera;
  const pose = sheet.pose(0.5, 0.5);
  const depths = sheet.depths();
  const [shown, hidden, other] = [0, 1, 2].map(() => new Uint8Array(width * height));
  const put = (point, isContent) => {
    const [x, y, z] = sheet.project(inPose(pose, point));
    const pixel = Math.floor(y) * width + Math.floor(x);
    const behind = z - depths[pixel];
    (Math.abs(behind) < NEAR_MM || !isContent ? other : behind > 0 ? hidden : shown)[pixel] = 1;
  };
  const turn = (i, n) => [Math.cos((2 * Math.PI * i) / n), Math.sin((2 * Math.PI * i) / n)];
  // Denser than pixels.
  for (let i = 0; i < 1000; i++) {
    for (let j = 0; j < 100; j++) {
      const [[c, s], [a, b]] = [turn(i, 1000), turn(j, 100)];
      const out = RING.radius + RING.tube * a;
      put([out * c, out * s, RING.tube * b], true);
    }
  }
  for (let i = 0; i < 200; i++) {
    for (let j = 0; j <= 100; j++) {
      const [[c, s], [a, b]] = [turn(i, 200), turn(j, 200)];
      put([BALL.radius * b * c, BALL.height + BALL.radius * a, BALL.radius * b * s], false);
    }
  }
  return { shown, hidden, other };
}

/** The pixels of a mask that are none of the others', and none of their neighbours. */
function only(mask, others, { width }) {
  const near = (i) => {
    for (const other of others) for (let dy = -2; dy <= 2; dy++) for (let dx = -2; dx <= 2; dx++) if (other[i + dy * width + dx]) return true;
    return false;
  };
  return [...mask.keys()].filter((i) => mask[i] && !near(i));
}

/** The middle of the pixels that show the ring. */
function ringMiddle(picture) {
  let [x, y, count] = [0, 0, 0];
  for (let row = 0; row < picture.height; row++)
    for (let column = 0; column < picture.width; column++)
      if (isRing(colorAt(picture, column, row))) [x, y, count] = [x + column + 0.5, y + row + 0.5, count + 1];
  return { x: x / count, y: y / count, count };
}

const middleOf = (pixels, width) => ({
  x: pixels.reduce((sum, i) => sum + (i % width) + 0.5, 0) / pixels.length,
  y: pixels.reduce((sum, i) => sum + Math.floor(i / width) + 0.5, 0) / pixels.length,
});

/** Mean difference between a picture and the clip's frame, which lies `scale` times as large at (left, top), beside the sheet; grey levels. */
function differenceBeside(depths, picture, frame, { scale, left, top }) {
  let [sum, count] = [0, 0];
  // Without the stamp.
  for (let y = 0; y < picture.height - 20; y += 3) {
    for (let x = 0; x < picture.width; x += 3) {
      const [column, row] = [Math.floor((x + 0.5 - left) / scale), Math.floor((y + 0.5 - top) / scale)];
      if (depths[row * frame.width + column] < Infinity) continue;
      const [at, from] = [picture.channels * (y * picture.width + x), 3 * (row * frame.width + column)];
      for (let k = 0; k < 3; k++) sum += Math.abs(picture.values[at + k] - frame.rgb[from + k]);
      count += 3;
    }
  }
  return sum / count;
}

test("an object stands where the sheet truly is, is hidden by it, and goes when it is gone", { timeout: 2 * SLOW_MS }, async (t) => {
  await onExample("object", async ({ next, page, shot }) => {
    const { width, height } = clip.camera;
    for (let i = 0; i < SHOTS; i++) {
      const { film, picture, sheet } = await next(isFollowed);
      const { shown, hidden, other } = trueRing(sheet);
      const ringAt = (pixel) => isRing(colorAt(picture, pixel % width, Math.floor(pixel / width)));
      const [drawn, wrong] = [only(shown, [hidden, other], picture), only(hidden, [shown, other], picture)].map((pixels) => {
        assert.ok(pixels.length > 1000, `${pixels.length} pixels`);
        return pixels.filter(ringAt).length / pixels.length;
      });
      const [is, truly] = [ringMiddle(picture), middleOf([...shown.keys()].filter((i) => shown[i]), width)];
      const off = Math.hypot(is.x - truly.x, is.y - truly.y);
      const difference = differenceBeside(sheet.depths(), picture, ofFilm(clip.frames, film).picture, { scale: 1, left: 0, top: 0 });
      t.diagnostic(`film ${film}: ${drawn.toFixed(3)} of the ring, ${wrong.toFixed(3)} of its hidden half, ${off.toFixed(2)} px off; background ${difference.toFixed(1)}`);
      // The rim of a ring of 20 px: a pixel off is 5 % of it.
      assert.ok(drawn > 0.8, `film ${film}: ${drawn} of the ring is drawn`);
      assert.ok(wrong < 0.01, `film ${film}: ${wrong} of what the sheet hides is drawn`);
      assert.ok(off < 6, `film ${film}: the ring is ${off} px off`);
      assert.ok(difference < 8, `film ${film}: the background is ${difference} grey levels off`);
    }
    const { picture } = await next((film) => film >= 2 * FRAMES + COVERED - 4);
    assert.ok(ringMiddle(picture).count < 40, "the ring is gone with the sheet");

    // An upright window cuts the image's sides, and all stays in its place.
    const [narrow, high] = [420, 600];
    await page.setViewportSize({ width: narrow, height: high });
    const view = { scale: high / height, left: (narrow - (width * high) / height) / 2, top: 0 };
    for (;;) {
      const upright = await shot();
      if (upright.width !== narrow || ringMiddle(upright).count < 1000) continue;
      const scores = clip.frames.map(({ picture }, i) => differenceBeside(sheets[i].depths(), upright, picture, view));
      const { shown } = trueRing(sheets[scores.indexOf(Math.min(...scores))]);
      const [is, truly] = [ringMiddle(upright), middleOf([...shown.keys()].filter((i) => shown[i]), width)];
      const off = Math.hypot(is.x - (truly.x * view.scale + view.left), is.y - (truly.y * view.scale + view.top));
      t.diagnostic(`upright: ${off.toFixed(2)} px off; background ${Math.min(...scores).toFixed(1)}`);
      assert.ok(off < 6, `upright: the ring is ${off} px off`);
      assert.ok(Math.min(...scores) < 8, `${scores}`);
      break;
    }
  });
});

/** Shorter side of the poster, mm. */
const POSTER_MM = 210;
/** Sum of the differences of a pixel's channels to the camera's frame, from which on it shows something else. */
const CHANGED = 60;
/** How far the house is looked for beside its place, pixels. */
const SEARCHED = 8;

test("on the demo page the house stands where the sheet truly is", { timeout: 2 * SLOW_MS }, async (t) => {
  const { width, height } = clip.camera;
  const demo = await openDemo(browser, { device: { viewport: { width, height } }, query: "?device=cpu", permissions: ["camera"] });
  const { page } = demo;
  await page.click("#use-camera");
  await page.waitForSelector('#live[data-mesh="true"]');
  await page.click('#overlays [value="object"]');
  // Nothing but the stage is to be seen; what is where stays.
  await page.evaluate(() => {
    for (const element of document.querySelectorAll("#live > :not(#stage)")) element.style.visibility = "hidden";
  });
  const { camera } = clip;
  const corners = cornersOf(OBJECTS.house());
  let shots = 0;
  for (const until = Date.now() + SLOW_MS; shots < SHOTS; ) {
    assert.ok(Date.now() < until, "the film does not show what is waited for");
    const picture = decodePng(await page.screenshot());
    const film = readStamp(stampPoints(height).map(([x, y]) => colorAt(picture, x, y)[1]));
    if (!isFollowed(film)) continue;
    const frame = ofFilm(clip.frames, film);
    const pose = ofFilm(sheets, film).pose(0.5, 0.5);
    const placed = corners.map((corner) => inPose(pose, corner.map((x) => SCALE * POSTER_MM * x)));
    const house = [...depthsOf(placed, camera)].map((depth) => depth < Infinity);
    const changed = house.map((_, i) => {
      const [x, y] = [i % width, Math.floor(i / width)];
      if (x < 1 || y < 1 || x >= width - 1 || y >= height - 1) return false;
      const [r, g, b] = colorAt(picture, x, y);
      const { rgb } = frame.picture;
      for (let dy = -1; dy <= 1; dy++)
        for (let dx = -1; dx <= 1; dx++) {
          const at = 3 * ((y + dy) * width + x + dx);
          if (Math.abs(rgb[at] - r) + Math.abs(rgb[at + 1] - g) + Math.abs(rgb[at + 2] - b) <= CHANGED) return false;
        }
      return true;
    });
    const pixels = inner(house, camera, 3);
    const shareAt = (dx, dy) => pixels.filter((i) => changed[i + dy * width + dx]).length / pixels.length;
    const drawn = shareAt(0, 0);
    // It comes with the frame after the click, which may be a later one.
    if (shots === 0 && drawn < 0.1) continue;
    // Its shadow aside, all else is as the camera saw it.
    const xs = pixels.map((i) => i % width);
    const [from, to] = [Math.min(...xs), Math.max(...xs)];
    const beside = [...changed.keys()].filter((i) => i % width < from - (to - from) || i % width > to + (to - from));
    const wrong = beside.filter((i) => changed[i]).length / beside.length;
    // The place at which most of it would be drawn: its middle, as some of it looks like the print.
    const best = [0, 0, 0];
    for (let dy = -SEARCHED; dy <= SEARCHED; dy++)
      for (let dx = -SEARCHED; dx <= SEARCHED; dx++) {
        const share = shareAt(dx, dy);
        if (share >= 0.995 * drawn) [best[0], best[1], best[2]] = [best[0] + dx, best[1] + dy, best[2] + 1];
      }
    const off = Math.hypot(best[0] / best[2], best[1] / best[2]);
    t.diagnostic(`film ${film}: ${drawn.toFixed(3)} of the house, ${off.toFixed(1)} px off; ${wrong.toFixed(4)} beside it`);
    assert.ok(pixels.length > 2000, `${pixels.length} pixels`);
    assert.ok(drawn > 0.7, `film ${film}: ${drawn} of the house is drawn`);
    assert.ok(off < 5, `film ${film}: ${off} px off`);
    assert.ok(wrong < 0.02, `film ${film}: ${wrong} of what is beside it has changed`);
    if (shots++ === 0) await demo.screenshot("three-page-house");
  }
  await demo.finish();
});

/** The squares of the new print, as the example paints them. */
const SQUARES = { columns: 11, rows: 8, colors: [[0xf2, 0xa6, 0x5a], [0x19, 0xb5, 0xa5]] };

test("a new print lies on the sheet to a few pixels, in the light of the real paper", { timeout: 2 * SLOW_MS }, async (t) => {
  await onExample("paper", async ({ next }) => {
    for (let i = 0; i < SHOTS; i++) {
      const { film, picture, sheet } = await next(isFollowed);
      const { picture: frame } = ofFilm(clip.frames, film);
      const depths = sheet.depths();
      const [right, ratios, lights] = [[], [], []];
      for (let column = 0; column < SQUARES.columns; column++) {
        for (let row = 0; row < SQUARES.rows; row++) {
          const color = SQUARES.colors[(column + row) % 2];
          const place = (a, b) => [(column + a) / SQUARES.columns, (row + b) / SQUARES.rows];
          // In its corners: 4 mm, some 6 pixels, from its borders.
          for (const [a, b] of [[0.15, 0.15], [0.85, 0.15], [0.15, 0.85], [0.85, 0.85]]) {
            const [x, y, z] = sheet.project(sheet.at(...place(a, b)));
            if (!(z < depths[Math.floor(y) * frame.width + Math.floor(x)] + NEAR_MM)) continue;
            const [r, , blue] = colorAt(picture, Math.floor(x), Math.floor(y));
            right.push(color[0] > color[2] ? r > blue : blue > r);
          }
          // Seen by the camera divided by what the poster has there, against drawn divided by what was painted.
          const [u, v] = place(0.5, 0.5);
          const light = litAt(frame, sheet, u, v) / printed(u, v, 0.03);
          const [x, y] = sheet.project(sheet.at(u, v)).map(Math.floor);
          const drawn = luminance(colorAt(picture, x, y)) / luminance(color);
          lights.push(light);
          ratios.push(drawn / light);
        }
      }
      const fraction = right.filter(Boolean).length / right.length;
      const [least, most] = [Math.min(...lights), Math.max(...lights)];
      const error = median(ratios.map((ratio) => Math.abs(ratio - 1)));
      const alike = correlation(lights, ratios.map((ratio, i) => ratio * lights[i]));
      t.diagnostic(`film ${film}: ${fraction.toFixed(3)} of ${right.length} places; light ${least.toFixed(2)} to ${most.toFixed(2)}, ${error.toFixed(3)} off, ${alike.toFixed(2)} alike`);
      assert.ok(right.length > 250, `${right.length} places`);
      assert.ok(fraction > 0.93, `film ${film}: ${fraction} of the places have their colour`);
      assert.ok(error < 0.12, `film ${film}: the light is ${error} off`);
      assert.ok(alike > 0.5, `film ${film}: the light is brighter where the paper is: ${alike}`);
    }
  });
});

/** Mean luminance of a frame around a place on the sheet. */
function litAt(frame, sheet, u, v) {
  let [sum, count] = [0, 0];
  for (let a = -0.03; a <= 0.03; a += 0.003) {
    for (let b = -0.03; b <= 0.03; b += 0.003, count++) {
      const [x, y] = sheet.project(sheet.at(u + a, v + b)).map(Math.floor);
      sum += luminance(colorAt({ ...frame, channels: 3, values: frame.rgb }, x, y));
    }
  }
  return sum / count;
}

/** Columns and rows of the pictures of the video that are compared, and how many it has a second: between two that are 0.2 s apart it looks like neither (0.6). */
const SMALL = { columns: 64, rows: 36, fps: 12 };
/** A picture of the page shows the video as it was at most so long before, seconds: when the camera's last frame was followed. (So far 0.1, at a load of 8 too.) */
const LATE_S = 1;

test("a video plays on the sheet, upright and in its place", { timeout: 2 * SLOW_MS }, async (t) => {
  await onExample("video", async ({ next, page }) => {
    const shots = [];
    for (let i = 0; i < SHOTS; i++) shots.push(await next(isFollowed));
    const moments = [];
    for (const { film, picture, sheet, from, until } of shots) {
      const known = (await page.evaluate(smallPictures, { ...SMALL, from: from - LATE_S, until })).map(({ time, rgba }) => {
        const values = Buffer.from(rgba, "base64");
        return { time, colors: Array.from({ length: SMALL.columns * SMALL.rows }, (_, i) => [...values.subarray(4 * i, 4 * i + 3)]) };
      });
      // The mean over a cell, as in the small pictures.
      const places = Array.from({ length: SMALL.columns * SMALL.rows }, (_, i) => {
        const cell = [0.17, 0.5, 0.83].flatMap((a) => [0.17, 0.5, 0.83].map((b) => [(i % SMALL.columns) + a, Math.floor(i / SMALL.columns) + b]));
        const colors = cell.map(([x, y]) => colorAt(picture, ...sheet.project(sheet.at(x / SMALL.columns, y / SMALL.rows)).slice(0, 2).map(Math.floor)));
        return [0, 1, 2].map((k) => Math.round(colors.reduce((sum, color) => sum + color[k], 0) / colors.length));
      });
      const logs = (colors) => colors.map((color) => Math.log(0.03 + luminance(color)));
      const likeness = known.map(({ colors }) => correlation(logs(colors), logs(places)));
      const best = Math.max(...likeness);
      const { time } = known[likeness.indexOf(best)];
      t.diagnostic(`film ${film}: like the video at ${time.toFixed(2)} s for ${from.toFixed(2)} to ${until.toFixed(2)} s, ${best.toFixed(3)}`);
      assert.ok(best > 0.7, `film ${film}: ${best}`);
      moments.push(time);
    }
    assert.ok(new Set(moments).size > 1, `the video plays: ${moments}`);
  });
});

/** Runs on the page: the video that it plays first, small, from one time to another. */
async function smallPictures({ columns, rows, fps, from, until }) {
  const video = Object.assign(document.createElement("video"), { src: played[0].src, muted: true });
  await new Promise((resolve) => (video.onloadeddata = resolve));
  const context = new OffscreenCanvas(columns, rows).getContext("2d", { willReadFrequently: true });
  context.imageSmoothingQuality = "high";
  const pictures = [];
  // It plays again and again.
  const end = until < from ? until + video.duration : until;
  for (let at = from; at <= end; at += 1 / fps) {
    const time = (at + video.duration) % video.duration;
    await new Promise((resolve) => {
      video.onseeked = resolve;
      video.currentTime = time;
    });
    context.drawImage(video, 0, 0, columns, rows);
    const { data } = context.getImageData(0, 0, columns, rows);
    pictures.push({ time, rgba: btoa(String.fromCharCode(...data)) });
  }
  return pictures;
}

test("of a lens that distorts the background shows what a pinhole would see", { timeout: SLOW_MS }, async () => {
  const pinhole = { width: 320, height: 180, fx: 250, fy: 255, cx: 165, cy: 88 };
  const lenses = [{ ...pinhole, distortion: [-0.25, 0.08, 0.004, -0.003, 0.01] }, { ...pinhole, fisheye: [0.04, -0.02, 0.006, -0.001] }];
  const demo = await openDemo(browser, { path: "/examples/object.html?clip" });
  try {
    // Red tells the column of the frame, green its row.
    const pictures = await demo.page.evaluate(async (lenses) => {
      const [{ Scene, WebGLRenderer }, { FrameBackground, FrameCamera }] = [await import("three"), await import("deepsft/three")];
      const [{ width, height }] = lenses;
      const pixels = Uint8ClampedArray.from({ length: 4 * width * height }, (_, i) => {
        const [x, y] = [Math.floor(i / 4) % width, Math.floor(i / 4 / width)];
        return [(255 * (x + 0.5)) / width, (255 * (y + 0.5)) / height, 90, 255][i % 4];
      });
      const renderer = new WebGLRenderer();
      renderer.setSize(width, height);
      const [camera, background] = [new FrameCamera(), new FrameBackground()];
      const scene = new Scene().add(background);
      const pictures = [];
      for (const lens of lenses) {
        camera.setIntrinsics(lens, lens);
        background.show({ frame: await createImageBitmap(new ImageData(pixels, width, height)) });
        renderer.render(scene, camera);
        const read = new Uint8Array(4 * width * height);
        const gl = renderer.getContext();
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, read);
        // As a text: lists of so many numbers take long to hand over.
        pictures.push(read.reduce((text, byte) => text + String.fromCharCode(byte), ""));
      }
      return pictures;
    }, lenses);
    const canonical = canonicalSize(pinhole);
    for (const [k, lens] of lenses.entries()) {
      let most = 0;
      for (const [x, y] of [[30.5, 20.5], [160.5, 90.5], [280.5, 30.5], [60.5, 150.5], [250.5, 140.5]]) {
        const ray = [(x - lens.cx) / lens.fx, (y - lens.cy) / lens.fy];
        const at = imageFromCanonical(lens, ray[0] * CANONICAL_FOCAL + canonical.width / 2, ray[1] * CANONICAL_FOCAL + canonical.height / 2);
        most = Math.max(most, Math.hypot(at[0] - x, at[1] - y));
        // The first row that is read is the lowest.
        const pixel = 4 * ((lens.height - 0.5 - y) * lens.width + x - 0.5);
        const [red, green] = [0, 1].map((channel) => pictures[k].charCodeAt(pixel + channel));
        const is = [(red * lens.width) / 255, (green * lens.height) / 255];
        // A grey level is 1.25 columns.
        assert.ok(Math.hypot(is[0] - at[0], is[1] - at[1]) < 2, `lens ${k}: (${x}, ${y}) shows ${is}, not ${at}`);
      }
      assert.ok(most > 6, `lens ${k} moves places by ${most} px at most`);
    }
  } finally {
    await demo.finish();
  }
});

function correlation(a, b) {
  const mean = (values) => values.reduce((sum, x) => sum + x, 0) / values.length;
  const [ma, mb] = [mean(a), mean(b)];
  const product = (x, mx, y, my) => x.reduce((sum, value, i) => sum + (value - mx) * (y[i] - my), 0);
  return product(a, ma, b, mb) / Math.sqrt(product(a, ma, a, ma) * product(b, mb, b, mb));
}
