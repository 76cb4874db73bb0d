// The page in three browser engines: camera, clip, image, a person's own picture, and what it says when something is in the way.
// What it finds is compared with the truth. The figures go to tests/screenshots/engines.md.

import assert from "node:assert/strict";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";

import { makeClip } from "../support/clips.mjs";
import { ENGINES, PATIENCE_MS, closeScreen, openEngine } from "../support/engines.mjs";
import { errorsOf } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { unseenFrames } from "../support/native.mjs";
import { encodePng } from "../support/png.mjs";
import { makePrint } from "../support/prints.mjs";
import { WWW, serve } from "../../serve.mjs";
import { makeObstacles, refusals, refusedCameras } from "./refusals.mjs";

/** @import { Refusal } from "./refusals.mjs" */

const TEST_MS = 600_000;
const SCREENSHOTS = join(WWW, "tests", "screenshots");

/** Of the bundled clip: what `deepsft clip` renders again, and the frame that is compared, after some that lead to it. */
const CLIP = { event: "motion", seed: 9_000_001, fps: 30, frame: 40, lead: 8 };
const PRINT = { width: 740, height: 525, seed: 7 };
const WIDTH_MM = 148;

/** Farthest that the median vertex may be from the truth, canonical pixels. A sheet that is not the one shown is tens away. */
const MAX_PX = 1;
/** The network alone, as `deepsft eval` finds it, with room for a frame that is harder than most. */
const MAX_REGISTRATION_MM = 8;
const MIN_IOU = 0.93;
/** So long the clip is watched for the rates, milliseconds. */
const WATCHED_MS = 4000;
/**
 * Engines in which the bundled clip is played. WebKitGTK's player (GStreamer) refuses it now and then on a busy machine, or never
 * ends a jump in it, whatever the page does: there the clip has several attempts, each in a fresh browser.
 */
const CLIP_ENGINES = (process.env.DEEPSFT_CLIP_ENGINES ?? ENGINES.join(",")).split(",");
const CLIP_ATTEMPTS = 4;
const CLIP_ATTEMPT_MS = 120_000;

const TITLES = { camera: "camera", clip: "clip", image: "image", own: "own picture", errors: "errors", keeps: "keeps", fps: "frames/s", answers: "answers/s" };
/** By engine, what is known of it. @type {Map<string, Record<string, string>>} */
const table = new Map();

let folder;
let server;
let obstacles;
/** Of the bundled clip: the mesh in {@link CLIP}'s frame, and that frame as a picture. */
let clipTruth;
let clipPng;
let frame;
let print;
let printTruth;
let printPng;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-engines-"));
    const { event, seed } = CLIP;
    const clip = await makeClip({ event, seed, frames: CLIP.frame + 1 });
    ({ vertices: clipTruth, png: clipPng } = clip.frames[CLIP.frame]);
    [frame] = await unseenFrames(join(folder), 1);
    frame.file = join(folder, "frame.png");
    await writeFile(frame.file, frame.png);
    print = join(folder, "print.png");
    await writeFile(print, encodePng(makePrint(PRINT)));
    const still = { event: "still", frames: 1, seed: 970_042, scale: 2, picture: print, widthMm: WIDTH_MM };
    const photographed = await makeClip(still);
    ({ vertices: printTruth, png: printPng } = photographed.frames[0]);
    server = await serve();
    obstacles = await makeObstacles(folder);
    await mkdir(SCREENSHOTS, { recursive: true });
  },
  { timeout: TEST_MS },
);

after(async () => {
  const head = ["engine", "version", ...Object.values(TITLES)];
  const rows = [...table].map(([name, row]) => [name, row.version, ...Object.keys(TITLES).map((key) => row[key] ?? "failed")]);
  const line = (cells) => `| ${cells.join(" | ")} |`;
  const text = [line(head), line(head.map(() => "---")), ...rows.map(line), ""].join("\n");
  console.log(`\n${text}`);
  await writeFile(join(SCREENSHOTS, "engines.md"), text);
  await Promise.all([server?.close(), obstacles?.close(), closeScreen()]);
  await rm(folder, { recursive: true, force: true });
});

/** The page, with what it tells of each frame kept. */
async function openPage(page, address = `${server.origin}/?device=cpu`) {
  await page.open(address);
  await page.run(() => {
    globalThis.tracked = [];
    globalThis.estimates = [];
    const small = Object.assign(document.createElement("canvas"), { width: 64, height: 36 }).getContext("2d", { willReadFrequently: true });
    globalThis.smallOf = (picture) => {
      small.drawImage(picture, 0, 0, 64, 36);
      return small.getImageData(0, 0, 64, 36).data;
    };
    document.addEventListener("deepsft-tracked", ({ tracked: { found, mesh, frame } }) =>
      tracked.push({ found, vertices: found ? [...mesh.vertices] : null, picture: smallOf(frame) }),
    );
    document.addEventListener("deepsft-estimate", ({ estimate }) =>
      estimates.push({
        at: performance.now(),
        found: estimate.found,
        maps: [estimate.depth, estimate.registration].map((map) => map.toFloat32Array()),
      }),
    );
  });
  // WebKit's driver does not wait for the page's scripts.
  await page.until(() => document.querySelector("#live").dataset.overlay !== undefined);
}

const isFound = () => document.querySelector("#state").dataset.state === "found";
const isFollowed = () => document.querySelector("#state").dataset.how === "tracked";
const isMissing = () => document.querySelector("#state").dataset.state === "missing";

/** What the card says that tells what is in the way. */
async function messageOf(page) {
  await page.until(() => document.querySelector("#message").open);
  return page.run(() => document.querySelector("#message-code").textContent);
}

/** A camera that shows a picture, in place of the browser's own: no browser here shows a file as a camera but Chromium. */
async function feedCamera(page, png) {
  await page.run(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [960, 540];
    const context = canvas.getContext("2d");
    const draw = () => context.drawImage(picture, 0, 0, 960, 540);
    draw();
    setInterval(draw, 60);
    navigator.mediaDevices.getUserMedia = async () => canvas.captureStream(15);
  }, png.toString("base64"));
}

/** How far the newest mesh is from the truth, once it has been followed for some frames. */
async function distanceTo(page, truth, scale = 1) {
  await page.run(() => (tracked.length = 0));
  await page.until(() => tracked.filter(({ found }) => found).length >= 5);
  const vertices = await page.run(() => tracked.findLast(({ found }) => found).vertices);
  return meshDistance(vertices.map((value, i) => (i % 3 === 2 ? value * scale : value)), truth).medianPx;
}

/** The page takes a camera for one of 0.79 times the long side; the clips' has 380 of 480: the mesh scales in depth. */
const AS_ESTIMATED = 380 / (0.79 * 480);

// Side by side: each waits for its own frames.
describe("engines", { concurrency: true }, () => {
  for (const name of ENGINES) describe(name, { concurrency: 1 }, () => {
    let page;
    const row = {};
    let refused = 0;
    const screenshot = async (what) => writeFile(join(SCREENSHOTS, `${name}-${what}.png`), await page.screenshot());

    before(
      async () => {
        table.set(name, row);
        page = await openEngine(name);
        row.version = page.version;
      },
      { timeout: TEST_MS },
    );
    after(() => page?.close());

    test("an image shows the poster where it is", { timeout: TEST_MS }, async () => {
      await openPage(page);
      await page.choose("#image-file", frame.file);
      await page.until(isFound);
      const [depth, registration] = await page.run(() => {
        const base64 = ({ buffer, byteOffset, byteLength }) => {
          let text = "";
          for (const byte of new Uint8Array(buffer, byteOffset, byteLength)) text += String.fromCharCode(byte);
          return btoa(text);
        };
        return estimates[0].maps.map(base64);
      });
      const floats = (text) => new Float32Array(new Uint8Array(Buffer.from(text, "base64")).buffer);
      const errors = errorsOf({ depth: floats(depth), registration: floats(registration) }, frame.truth);
      await page.until(() => document.querySelector("#live").dataset.mesh === "true");
      await screenshot("image");
      assert.ok(errors.mask_iou > MIN_IOU, `mask IoU ${errors.mask_iou}`);
      assert.ok(errors.registration_rmse_mm < MAX_REGISTRATION_MM, `registration ${errors.registration_rmse_mm} mm`);
      row.image = `IoU ${errors.mask_iou.toFixed(3)}, ${errors.registration_rmse_mm.toFixed(1)} mm`;
    });

    const playsClip = async () => {
      // With the poster's network: its answers are counted.
      await openPage(page, `${server.origin}/?device=cpu&model=models/poster-a4/`);
      await page.click("#use-clip");
      await page.until(() => tracked.length > 0);
      await page.until(isFollowed);
      await page.run(() => void (tracked.length = estimates.length = 0));
      const { frames, answers, seconds } = await page.run(
        (ms) =>
          new Promise((resolve) => {
            const from = performance.now();
            setTimeout(() => resolve({ frames: tracked.length, answers: estimates.length, seconds: (performance.now() - from) / 1000 }), ms);
          }),
        WATCHED_MS,
      );
      await screenshot("clip");
      const apart = meshDistance(await meshInFrame(page), clipTruth).medianPx;
      return { apart, fps: (frames / seconds).toFixed(1), answers: (answers / seconds).toFixed(1) };
    };

    test("the bundled clip plays, and the mesh lies on the sheet in a frame that is known", { timeout: TEST_MS }, async (t) => {
      if (!CLIP_ENGINES.includes(name)) return t.skip("played by cargo xtask engines");
      let played = null;
      for (let attempt = 1; !played; attempt++) {
        const last = name !== "webkit" || attempt === CLIP_ATTEMPTS;
        const patience = last ? [] : [new Promise((_, reject) => setTimeout(reject, CLIP_ATTEMPT_MS, new Error("the player hangs")))];
        try {
          played = await Promise.race([playsClip(), ...patience]);
        } catch (error) {
          if (last) throw error;
          t.diagnostic(`attempt ${attempt}: ${error.message.trim().split("\n").at(-1).trim()}`);
          await page.close();
          page = await openEngine(name);
        }
      }
      const { apart, fps, answers } = played;
      assert.ok(apart < MAX_PX, `${apart} px from the truth`);
      Object.assign(row, { clip: `${apart.toFixed(2)} px`, fps, answers });
    });

    test("where H.264 is not known the clip plays as VP8", { timeout: TEST_MS }, async (t) => {
      await openPage(page);
      const knows = await page.run(() => {
        const { canPlayType } = HTMLMediaElement.prototype;
        HTMLMediaElement.prototype.canPlayType = function (type) {
          return type.startsWith("video/mp4") ? "" : canPlayType.call(this, type);
        };
        return document.createElement("video").canPlayType('video/webm; codecs="vp8"') !== "";
      });
      if (!knows || !CLIP_ENGINES.includes(name)) return t.skip("this browser knows no VP8, or is not to play a clip");
      await page.click("#use-clip");
      await page.until(() => tracked.length > 0);
      const apart = meshDistance(await meshInFrame(page), clipTruth).medianPx;
      assert.ok(apart < MAX_PX, `${apart} px from the truth`);
    });

    test("a picture and a recording of what is seen are handed over to be shared", { timeout: TEST_MS }, async () => {
      await openPage(page);
      await feedCamera(page, clipPng);
      await page.run(() => {
        globalThis.shared = [];
        navigator.canShare = () => true;
        navigator.share = async ({ files: [file] }) => void shared.push(file);
      });
      await page.click("#use-camera");
      await page.until(isFollowed);
      await page.click("#shots button:first-child");
      await page.until(() => shared.length === 1);
      const picture = await page.run(async () => {
        const { width, height } = await createImageBitmap(shared[0]);
        const even = (length) => 2 * Math.round((length * devicePixelRatio) / 2);
        return { type: shared[0].type, is: [width, height], wanted: [even(innerWidth), even(innerHeight)] };
      });
      assert.equal(picture.type, "image/png");
      assert.deepEqual(picture.is, picture.wanted);
      const records = await page.run(() => document.querySelector("#shots button:last-child").checkVisibility?.() ?? typeof MediaRecorder === "function");
      row.keeps = "picture";
      if (!records) return;
      await page.click("#shots button:last-child");
      await page.until(() => document.querySelector("#shots .time").textContent >= "0:05");
      await page.click("#shots button:last-child");
      await page.until(() => shared.length === 2);
      // WebKitGTK, where it has encoders and records, plays no video from memory.
      if (name === "webkit") return;
      const recording = await page.run(async () => {
        const video = Object.assign(document.createElement("video"), { muted: true, src: URL.createObjectURL(shared[1]) });
        await video.play();
        await new Promise((resolve) => video.addEventListener("ended", resolve));
        return { is: [video.videoWidth, video.videoHeight], seconds: video.currentTime, type: shared[1].type };
      });
      assert.deepEqual(recording.is, picture.wanted);
      assert.ok(recording.seconds > 2, `${recording.seconds} s`);
      row.keeps = `picture, ${recording.type.slice(6)}`;
    });

    test("the browser's own camera is opened, and shows no poster", { timeout: TEST_MS }, async () => {
      await openPage(page);
      await page.click("#use-camera");
      await page.until(isMissing);
      await page.until(() => tracked.length >= 5);
      await screenshot("camera");
      row.camera = "opens";
    });

    test("a camera that shows the poster shows it where it is", { timeout: TEST_MS }, async () => {
      await openPage(page);
      await feedCamera(page, clipPng);
      await page.click("#use-camera");
      await page.until(isFollowed);
      const apart = await distanceTo(page, clipTruth, AS_ESTIMATED);
      await screenshot("camera-poster");
      assert.ok(apart < MAX_PX, `${apart} px from the truth`);
      row.camera = `${row.camera ?? "does not open"}; fed: ${apart.toFixed(2)} px`;
    });

    test("a person's own picture is found where it is", { timeout: TEST_MS }, async () => {
      await openPage(page);
      await feedCamera(page, printPng);
      await page.choose("#picture-file", print);
      await page.until(() => document.querySelector("#print-size").getBoundingClientRect().width > 0);
      await page.click('[value="postcard"]');
      await page.click('#print-size [value="camera"]');
      await page.until(isFollowed);
      const apart = await distanceTo(page, printTruth, AS_ESTIMATED);
      await screenshot("own-picture");
      assert.ok(apart < MAX_PX, `${apart} px from the truth`);
      row.own = `${apart.toFixed(2)} px`;
    });

    let known = 1;
    /** A test of something that is in the way: the page names it, and offers a way on. @param {Refusal} refusal */
    const refuses = ({ what, code, cause }) => {
      known++;
      test(`${what}: ${code}`, { timeout: TEST_MS }, async () => {
        await cause({ ...page, load: (address = "?device=cpu") => openPage(page, new URL(address, server.origin).href) });
        assert.equal(await messageOf(page), code);
        await screenshot(`refused-${code}`);
        const remedies = await page.run(() => document.querySelectorAll("#message-remedies button").length);
        assert.ok(remedies > 0, "there is a way on");
        row.errors = `${++refused} of ${known}`;
      });
    };
    for (const refusal of refusals(() => obstacles)) refuses(refusal);
    const { denied, missing } = refusedCameras(name);

    describe("with no WebGL and a camera that is not allowed", { concurrency: 1 }, () => {
      before(
        async () => {
          await page.close();
          page = await openEngine(name, { webgl: false, camera: "denied" });
        },
        { timeout: TEST_MS },
      );

      test("the page says so: browser-unsupported", { timeout: TEST_MS }, async () => {
        await openPage(page);
        assert.equal(await page.run(() => document.createElement("canvas").getContext("webgl2") === null), true);
        await feedCamera(page, clipPng);
        await page.click("#use-camera");
        assert.equal(await messageOf(page), "browser-unsupported");
        await screenshot("no-webgl");
        row.errors = `${++refused} of ${known}`;
      });

      refuses(denied);
    });

    describe("with no camera", { concurrency: 1 }, () => {
      before(
        async () => {
          await page.close();
          page = await openEngine(name, { camera: "none" });
        },
        { timeout: TEST_MS },
      );

      refuses(missing);
    });
  });
});

/** The mesh in {@link CLIP}'s frame: the clip stands still and is moved on by hand, a few frames to it. */
async function meshInFrame(page) {
  return page.run(async ({ frame, lead, fps, patienceMs }) => {
    const video = document.querySelector("#video");
    const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    const holds = async (condition, ms) => {
      for (const end = performance.now() + ms; performance.now() < end; await pause(10)) if (condition()) return true;
      return false;
    };
    /** GStreamer, below WebKit, now and then never ends a seek: only loading the clip anew helps. */
    const seeks = async (at) => {
      video.currentTime = (at + 0.5) / fps;
      if (await holds(() => !video.seeking, 3000)) return true;
      video.load();
      await Promise.race([video.play(), pause(10_000)]).catch(() => undefined);
      return false;
    };
    /** Whether the clip shows the frame, and the tracker has answered. */
    const show = async (at) => {
      await pause(100);
      video.pause();
      tracked.length = 0;
      return (await seeks(at)) && (await holds(() => tracked.length > 0, 8000));
    };
    const apart = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0);
    const end = performance.now() + patienceMs;
    while (performance.now() < end) {
      for (let at = frame - lead; at < frame; at++) await show(at);
      const before = smallOf(video);
      if (!(await show(frame))) continue;
      // The frame before may be answered late: the picture tells.
      const isOfFrame = () => apart(tracked.at(-1).picture, smallOf(video)) < apart(tracked.at(-1).picture, before);
      if ((await holds(isOfFrame, 8000)) && tracked.at(-1).found) return tracked.at(-1).vertices;
    }
    const { paused, seeking, readyState, currentTime } = video;
    throw new Error(`the sheet is not followed from frame to frame: ${JSON.stringify({ paused, seeking, readyState, currentTime, tracked: tracked.length })}`);
  }, { ...CLIP, patienceMs: PATIENCE_MS / 2 });
}
