// The canonical image as the browser crops and scales it: against the engine's warp, and what it spares the workers.

import assert from "node:assert/strict";
import { before, test } from "node:test";

import { makeClip } from "../support/clips.mjs";
import { median } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { SLOW_MS } from "../support/browser.mjs";
import { onPage } from "../support/page.mjs";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_002;
const FRAMES = 12;
/** 1440 x 810 pixels: three a canonical pixel, which no halving gives. */
const SCALE = 3;

/** Both images followed from the same start: far below what the tracker errs by, some 0.2 px and 0.5 mm. */
const SAME_MESH = { rmsMm: 0.3, medianPx: 0.06 };
/** Root mean square of the difference in colour, of 255: the engine's mean of 3 x 3 pixels against the browser's filter. */
const SAME_PICTURE = { halved: 1, third: 4, shifted: 6, upright: 4, across: 1 };
/** Root mean square, of 255: two ways from YUV to RGB round differently. */
const SAME_COLOURS = 2;

let clip;

before(async () => {
  clip = await makeClip({ event: "motion", frames: FRAMES, seed: SEED, scale: SCALE });
}, { timeout: SLOW_MS });

test("the browser's canonical image is the engine's warp to a few grey levels, black where the frame ends", { timeout: SLOW_MS }, (t) =>
  onPage({}, async ({ page }) => {
    const found = await page.evaluate(async ([address, cameraOfClip]) => {
      const { canonicalFrame } = await import("/src/frames/canonical-frame.js");
      const { cameraForImage } = await import("/src/camera/intrinsics.js");
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const whole = await createImageBitmap(await (await fetch(address)).blob());
      const half = await createImageBitmap(whole, { resizeWidth: 960, resizeHeight: 540, resizeQuality: "high" });
      const { fx } = cameraOfClip;
      const cases = {
        third: [whole, cameraOfClip],
        halved: [half, { width: 960, height: 540, fx: (fx * 2) / 3, fy: (fx * 2) / 3, cx: 480, cy: 270 }],
        // Ends within the canonical image on the left and above, and lies between pixels.
        shifted: [half, { width: 960, height: 540, fx: 800, fy: 790, cx: 433.3, cy: 221.7 }],
        // A part of it that stands upright, after frames that lie across, and across again.
        upright: [await createImageBitmap(whole, 330, 0, 700, 810), { width: 700, height: 810, fx, fy: fx, cx: 390, cy: 405 }],
        across: [half, { width: 960, height: 540, fx: (fx * 2) / 3, fy: (fx * 2) / 3, cx: 480, cy: 270 }],
      };
      const measured = {};
      for (const [name, [frame, camera]] of Object.entries(cases)) {
        const estimate = await sft.estimate(frame, { camera });
        const { data: warped } = estimate.canonical;
        // Twice each: what is read must not show through in the next.
        for (const asPixels of [false, true, true]) {
          // A camera that sees more than the training camera's view may be answered in a wider one.
          const canonical = canonicalFrame(frame, cameraForImage(camera, frame.width, frame.height), asPixels, estimate.focal);
          const { width, height } = canonical;
          const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
          if (!asPixels) context.drawImage(canonical, 0, 0);
          const { data } = asPixels ? canonical : context.getImageData(0, 0, width, height);
          let [squares, corner] = [0, 0];
          for (let i = 0; i < data.length; i++) if (i % 4 < 3) squares += (data[i] - warped[i]) ** 2;
          for (let i = 0; i < 3; i++) corner += data[i] + warped[i];
          (measured[name] ??= []).push({ asPixels, size: [width, height], rms: Math.sqrt(squares / (3 * 480 * 270)), corner });
        }
        estimate.close();
      }
      const bent = cameraForImage({ ...cameraOfClip, distortion: [0.1, 0, 0, 0, 0] }, whole.width, whole.height);
      measured.bent = canonicalFrame(whole, bent);
      const little = await createImageBitmap(whole, { resizeWidth: 480, resizeHeight: 270 });
      measured.little = canonicalFrame(little, cameraForImage(cameraOfClip, 480, 270));
      sft.close();
      return measured;
    }, [clip.frames[0].address, clip.camera]);
    t.diagnostic(JSON.stringify(found));
    for (const [name, most] of Object.entries(SAME_PICTURE)) {
      for (const { size, rms } of found[name]) {
        assert.deepEqual(size, name === "upright" ? [270, 480] : [480, 270], name);
        assert.ok(rms <= most, `${name}: ${rms}`);
      }
    }
    for (const { corner } of found.shifted) assert.equal(corner, 0, "beyond the frame both are black");
    assert.equal(found.bent, null, "a lens that distorts takes the engine's warp");
    assert.equal(found.little, null, "and so does a frame that is no larger");
  }),
);

test("the tracker follows the browser's canonical image as it follows the whole frame", { timeout: SLOW_MS }, (t) =>
  onPage({}, async ({ page }) => {
    const runs = await page.evaluate(async ([addresses, camera]) => {
      const [{ WorkerCalls }, { compileEngine }, { fetchBundle }, { cameraForImage, intrinsicsOf }, { canonicalFrame, canonicalIntrinsics }] =
        await Promise.all(
          ["engine/worker-calls", "engine/engine-worker", "engine/bundle", "camera/intrinsics", "frames/canonical-frame"].map(
            (name) => import(`/src/${name}.js`),
          ),
        );
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const module = await compileEngine(new URL("/dist/deepsft_web_bg.wasm", location.href));
      const files = await fetchBundle(new URL("/models/poster-a4/", location.href));
      const bitmaps = await Promise.all(addresses.map(async (address) => createImageBitmap(await (await fetch(address)).blob())));
      const sourced = cameraForImage(camera, camera.width, camera.height);
      const { vertices } = await (await sft.estimate(bitmaps[0], { camera })).completeMesh();
      const run = async (isCanonical) => {
        const tracker = new WorkerCalls();
        await tracker.call("startTracker", { module, targets: [{ id: 0, source: { kind: "model", files } }], smooth: null });
        const [meshes, times] = [[], []];
        for (const [number, bitmap] of bitmaps.entries()) {
          const frame = isCanonical ? canonicalFrame(bitmap, sourced) : await createImageBitmap(bitmap);
          const intrinsics = isCanonical ? canonicalIntrinsics(sourced) : intrinsicsOf(sourced);
          const question = number === 0 ? { ids: [0], onlyConfirms: false } : null;
          const { targets, readMs, times: { warpMs } } = await tracker.call("follow", { timeS: number / 30, frame, intrinsics, question });
          const answers = [{ id: 0, sightings: [vertices.slice()] }];
          if (question) await tracker.call("answer", { answers, tookMs: 10, sinceMissedMs: Infinity });
          else meshes.push([...targets[0].surface.vertices]);
          times.push(readMs + warpMs);
        }
        tracker.terminate(new Error("done"));
        return { meshes, times };
      };
      const both = [await run(false), await run(true)];
      sft.close();
      return both;
    }, [clip.frames.map(({ address }) => address), clip.camera]);
    const [whole, canonical] = runs;
    assert.equal(whole.meshes.length, FRAMES - 1);
    const distances = whole.meshes.map((mesh, i) => meshDistance(canonical.meshes[i], mesh));
    t.diagnostic(`worst ${Math.max(...distances.map(({ medianPx }) => medianPx))} px, ${Math.max(...distances.map(({ rmsMm }) => rmsMm))} mm`);
    t.diagnostic(`reading and warp: ${median(whole.times)} ms of the whole frame, ${median(canonical.times)} ms`);
    for (const [figure, most] of Object.entries(SAME_MESH))
      for (const distance of distances) assert.ok(distance[figure] <= most, `${figure} ${distance[figure]}`);
  }),
);

/** What is posted to the workers while a mesh is followed, by method: sizes of the pictures. */
async function posted(page, camera) {
  return page.evaluate(async (camera) => {
    const sizes = { follow: [], find: [] };
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (message, transfer) {
      const frame = message.request?.frame;
      if (frame) sizes[message.method].push([frame.width, frame.height, transfer.includes(frame)].join(" "));
      return postMessage.call(this, message, transfer);
    };
    const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
    const video = document.createElement("video");
    Object.assign(video, { src: "/demo/clip.webm", muted: true, loop: true });
    await video.play();
    video.playbackRate = 0.25;
    const frames = [];
    let confirmed = 0;
    const session = sft.follow(video, {
      camera,
      onEstimate: (estimate) => {
        frames.push([estimate.frame.width, estimate.frame.height].join(" "));
        estimate.close();
        if (sizes.find.at(-1) !== sizes.find[0]) confirmed++;
        if (confirmed === 3 || sizes.find.length === 8) session.close();
      },
    });
    for await (const { frame } of session) frames.push([frame.width, frame.height].join(" "));
    sft.close();
    Worker.prototype.postMessage = postMessage;
    return { follow: [...new Set(sizes.follow)], find: [sizes.find[0], sizes.find.at(-1)], frames: [...new Set(frames)] };
  }, camera);
}

test("the workers get 480 x 270 pixels of a frame, the finders more only while something is missing; the page keeps the frame", { timeout: SLOW_MS }, () =>
  onPage({}, async ({ page }) => {
    const camera = { width: 960, height: 540, fx: 760, fy: 760, cx: 480, cy: 270 };
    const small = await posted(page, camera);
    assert.deepEqual(small, { follow: ["480 270 true"], find: ["960 540 true", "480 270 true"], frames: ["960 540"] });
    const bent = await posted(page, { ...camera, distortion: [0.01, 0, 0, 0, 0] });
    assert.deepEqual(bent, { follow: ["960 540 true"], find: ["960 540 true", "960 540 true"], frames: ["960 540"] });
  }),
);

test("a frame read from a video's memory has the colours of the drawn one, and where that cannot be the browser draws it", { timeout: SLOW_MS }, (t) =>
  onPage({}, async ({ page }) => {
    const found = await page.evaluate(async () => {
      const { MemoryFrames } = await import("/src/frames/memory-frames.js");
      const video = Object.assign(document.createElement("video"), { muted: true, src: "/demo/clip.webm" });
      await video.play();
      video.pause();
      const pixelsOf = (bitmap) => {
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", { willReadFrequently: true });
        context.drawImage(bitmap, 0, 0);
        return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
      };
      const memory = new MemoryFrames();
      // A video that was paused may still move on by a frame.
      let [read, drawn, stands] = [null, await createImageBitmap(video), false];
      while (!stands) {
        const before = pixelsOf(drawn);
        read?.frame.close();
        read = await memory.grab(video);
        drawn = await createImageBitmap(video);
        stands = pixelsOf(drawn).every((value, i) => value === before[i]);
      }
      // The next frames do not change it.
      for (let i = 1; i < 5; i++) {
        const there = new Promise((resolve) => video.addEventListener("seeked", resolve, { once: true }));
        video.currentTime = 0.5 * i;
        await there;
        (await memory.grab(video)).frame.close();
      }
      const [a, b] = [read.frame, drawn].map(pixelsOf);
      const rms = Math.sqrt(a.reduce((sum, value, i) => sum + (value - b[i]) ** 2, 0) / a.length);
      const empty = await memory.grab(document.createElement("video"));
      const { VideoFrame } = globalThis;
      globalThis.VideoFrame = class extends VideoFrame {
        get format() {
          return null;
        }
      };
      const onGpu = await memory.grab(video);
      globalThis.VideoFrame = class extends VideoFrame {
        copyTo(pixels) {
          return super.copyTo(pixels);
        }
      };
      const inPlanes = await memory.grab(video);
      delete globalThis.VideoFrame;
      const unknown = await memory.grab(video);
      return { rms, size: [read.width, read.height, read.frame.width, read.frame.height], empty, onGpu, inPlanes, unknown };
    });
    t.diagnostic(JSON.stringify(found));
    assert.deepEqual(found.size, [960, 540, 960, 540]);
    assert.ok(found.rms < SAME_COLOURS, `${found.rms}`);
    assert.deepEqual([found.empty, found.onGpu, found.inPlanes, found.unknown], [null, null, null, null]);
  }));
