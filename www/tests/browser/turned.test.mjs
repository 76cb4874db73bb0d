// A phone that is turned while it films, and another camera in its place: the mesh lies on the sheet in every frame in which it is drawn.
// The frames are a canvas's stream in place of the camera's, which no browser turns under test.

import assert from "node:assert/strict";
import { before, test } from "node:test";

import { PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { meshDistance } from "../support/meshes.mjs";

/** Clips have seeds from 9,000,000 on; these are the tests' own. */
const CLIPS = {
  across: { seed: 9_700_032, colour: "#f00" },
  upright: { seed: 9_700_031, colour: "#0f0", upright: true },
  other: { seed: 9_700_034, colour: "#00f" },
};
/** The median vertex, canonical pixels. A mesh of the picture before is tens away. */
const MAX_PX = 1;
const FRAMES_WATCHED = 15;

const clips = {};

before(async () => {
  for (const [name, { seed, upright }] of Object.entries(CLIPS)) {
    const { frames } = await makeClip({ event: "still", frames: 1, seed, upright });
    clips[name] = { png: frames[0].png.toString("base64"), vertices: frames[0].vertices };
  }
}, { timeout: SLOW_MS });

/** The size that a camera delivers: 640 x 360, or upright 360 x 640. */
const sizeOf = (name) => (CLIPS[name].upright ? { width: 360, height: 640 } : { width: 640, height: 360 });

/** What a clip's mesh lies in. */
const canonicalOf = (name) => (CLIPS[name].upright ? { width: 270, height: 480 } : { width: 480, height: 270 });

/** Two cameras, `first` and `second`, that show pictures; `globalThis.turn(camera, name)` has one show another, in another size. */
async function feed(page) {
  const pictures = Object.fromEntries(Object.entries(clips).map(([name, { png }]) => [name, { png, colour: CLIPS[name].colour, ...sizeOf(name) }]));
  await page.evaluate(async (pictures) => {
    const cameras = {};
    const bitmaps = {};
    for (const [name, { png }] of Object.entries(pictures))
      bitmaps[name] = await createImageBitmap(new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))]));
    for (const id of ["first", "second"]) cameras[id] = { canvas: document.createElement("canvas"), name: "across" };
    const draw = ({ canvas, name }) => {
      const { width, height, colour } = pictures[name];
      if (canvas.width !== width) [canvas.width, canvas.height] = [width, height];
      const context = canvas.getContext("2d");
      context.drawImage(bitmaps[name], 0, 0, width, height);
      // Tells afterwards which picture a frame shows.
      context.fillStyle = colour;
      context.fillRect(0, 0, 16, 16);
    };
    const pixel = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    const shownBy = (frame) => {
      pixel.drawImage(frame, 4, 4, 8, 8, 0, 0, 1, 1);
      const rgb = [...pixel.getImageData(0, 0, 1, 1).data.slice(0, 3)];
      return Object.keys(pictures)[rgb.indexOf(Math.max(...rgb))];
    };
    globalThis.turn = (id, name) => {
      cameras[id].name = name;
      draw(cameras[id]);
    };
    setInterval(() => Object.values(cameras).forEach(draw), 60);
    Object.values(cameras).forEach(draw);
    const devices = navigator.mediaDevices;
    devices.getUserMedia = async ({ video }) => {
      const id = video.deviceId?.exact ?? "first";
      const stream = cameras[id].canvas.captureStream(15);
      const [track] = stream.getVideoTracks();
      track.getSettings = () => ({ deviceId: id });
      return stream;
    };
    devices.enumerateDevices = async () =>
      Object.keys(cameras).map((id) => ({ kind: "videoinput", deviceId: id, label: id === "first" ? "Back Camera" : "Front Camera" }));
    globalThis.tracked = [];
    document.addEventListener("deepsft-tracked", ({ tracked: { found, mesh, camera, frame } }) =>
      tracked.push({
        at: performance.now(),
        shown: shownBy(frame),
        vertices: found ? [...mesh.vertices] : null,
        sizes: [camera, frame].map(({ width, height }) => ({ width, height })),
      }),
    );
  }, pictures);
}

test("a phone is turned and turned back, then another camera takes over: the mesh is found again and never lies where it was", { timeout: SLOW_MS }, async (t) => {
  const browser = await launch({ webgpu: false });
  try {
    const demo = await openDemo(browser, { device: PHONE, query: "?device=cpu", permissions: ["camera"] });
    const { page } = demo;
    await feed(page);
    await page.click("#use-camera");
    /** Has something change, and watches until the mesh has been there for a while in the picture that shows then. */
    const watch = async (title, picture, change) => {
      const [from, since] = await page.evaluate(() => [tracked.length, performance.now()]);
      await change();
      await page.waitForFunction(
        ([from, picture, most]) => tracked.slice(from).filter(({ shown, vertices }) => vertices && shown === picture).length >= most,
        [from, picture, FRAMES_WATCHED],
      );
      const frames = await page.evaluate((from) => tracked.slice(from), from);
      const distances = frames.flatMap(({ shown, vertices, sizes }) => {
        for (const size of sizes) assert.deepEqual(size, sizeOf(shown), `${title}: ${shown}`);
        return vertices ? [meshDistance(vertices, clips[shown].vertices, canonicalOf(shown)).medianPx] : [];
      });
      const first = frames.find(({ shown }) => shown === picture);
      const again = frames.find(({ shown, vertices }) => vertices && shown === picture);
      const most = Math.max(...distances);
      t.diagnostic(`${title}: shown after ${(first.at - since).toFixed(0)} ms, found after ${(again.at - since).toFixed(0)} ms; ${distances.length} meshes, at most ${most.toFixed(2)} px off`);
      assert.ok(most <= MAX_PX, `${title}: ${distances}`);
    };
    await watch("as it begins", "across", () => undefined);
    await watch("turned", "upright", () => page.evaluate(() => turn("first", "upright")));
    await demo.screenshot("turned-upright-phone");
    await watch("turned back", "across", () => page.evaluate(() => turn("first", "across")));
    await page.evaluate(() => turn("second", "other"));
    await watch("another camera", "other", () => page.click("#cameras button"));
    await page.waitForSelector('#cameras button[aria-label="Front camera. Change to: Back camera"]');
    await demo.screenshot("switched-phone");
    await demo.finish();
  } finally {
    await browser.close();
  }
});
