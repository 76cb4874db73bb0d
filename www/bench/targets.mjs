// Pictures as targets in Chromium, on its CPU: what it takes to add one, to find 1, 4 and 16 in a frame, and to follow two before a
// camera of 30 frames per second while a third is looked for in vain. By hand, on a machine that does nothing else:
//
//     DEEPSFT_CLI=target/release/deepsft node bench/targets.mjs [SECONDS] > bench/targets.json

import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { availableParallelism, loadavg, tmpdir } from "node:os";
import { join } from "node:path";

import { ROOT } from "../serve.mjs";
import { KEEP_MEMORY, inWorker, onPage, wasmBytes } from "../tests/support/page.mjs";
import { encodePng } from "../tests/support/png.mjs";
import { makePrint } from "../tests/support/prints.mjs";
import { PRINTS, thereAndBack, twoPrints } from "../tests/support/two-prints.mjs";
import { y4m } from "../tests/support/y4m.mjs";

const FRAMES = 60;
const CAMERA_FPS = 30;
/** What starts the tracks is not measured, seconds. */
const WARM_UP_S = 10;
/** How many targets are looked for at once. The first two are in the picture. */
const COUNTS = [1, 4, 16];
/** Frames of the film in which they are looked for, and those before that warm up. */
const LOOKED_AT = 24;
const WARM_UP = 6;
/** A picture is added so many times. */
const ADDED = 5;

const seconds = Number(process.argv[2] ?? 20);

/** On the page: what its evaluated functions share. */
function share() {
  globalThis.blobOf = (base64) => new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]);
  globalThis.summary = (times) => {
    const sorted = times.toSorted((a, b) => a - b);
    return { median_ms: sorted[sorted.length >> 1], min_ms: sorted[0], max_ms: sorted.at(-1) };
  };
}

/** On the page: adding three kinds of pictures to an engine that is running. */
async function measureAdding([poster, shapes, added]) {
  const text = new OffscreenCanvas(707, 1000);
  const context = text.getContext("2d");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, 707, 1000);
  context.fillStyle = "#111";
  context.font = "17px serif";
  for (let line = 0; line < 44; line++) {
    const words = Array.from({ length: 11 }, (_, i) => (0.37 + 0.618034 * (11 * line + i) * (line + 3)).toString(36).slice(3, 6 + (i % 5)));
    context.fillText(words.join(" "), 50, 60 + 20 * line);
  }
  const sft = await deepsft.DeepSft.load();
  const pictures = { poster: blobOf(poster), shapes: blobOf(shapes), text: await text.convertToBlob() };
  const measured = {};
  for (const [name, picture] of Object.entries(pictures)) {
    const times = [];
    for (let i = 0; i < added; i++) {
      const began = performance.now();
      const target = await sft.addPicture(picture, { widthMm: 210 });
      times.push(performance.now() - began);
      const { width, height } = target.texture;
      measured[name] = { pixels: [width, height], grade: target.grade.level };
      sft.removeTarget(target);
    }
    Object.assign(measured[name], { first_ms: times[0], ...summary(times) });
  }
  sft.close();
  return measured;
}

/** On the page: an engine of its own that nothing else uses, and the frames. */
async function startFinding(frames) {
  const [{ WorkerCalls }, { compileEngine }] = await Promise.all(["worker-calls", "engine-worker"].map((name) => import(`/src/engine/${name}.js`)));
  const module = await compileEngine(new URL("/dist/deepsft_web_bg.wasm", location.href));
  const worker = new WorkerCalls();
  await worker.call("start", { module, files: null, device: "cpu" });
  const pixelsOf = async (frame) => {
    const bitmap = await createImageBitmap(blobOf(frame));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height);
  };
  Object.assign(globalThis, { engine: worker, frames: await Promise.all(frames.map(pixelsOf)), added: 0 });
}

/** On the page: adds pictures to that engine. */
async function addTargets([pictures, widthsMm]) {
  const { pictureSource } = await import("/src/targets/target-source.js");
  for (const [i, picture] of pictures.entries())
    await engine.call("addTarget", { id: ++added, source: await pictureSource(blobOf(picture), { widthMm: widthsMm[i] }) });
}

/** On the page: looks for all of them, or for those with the numbers `ids`, in every frame. */
async function measureFinding([camera, warmUp, ids]) {
  const { intrinsicsOf } = await import("/src/camera/intrinsics.js");
  const all = ids ?? Array.from({ length: added }, (_, i) => i + 1);
  const intrinsics = intrinsicsOf({ ...camera, distortion: [0, 0, 0, 0, 0] });
  // A view of the whole image.
  const focal = (camera.fx * 480) / camera.width;
  const times = [];
  let found = 0;
  for (const [i, { data, width, height }] of [...frames.slice(0, warmUp), ...frames].entries()) {
    const frame = new ImageData(new Uint8ClampedArray(data), width, height);
    const began = performance.now();
    const { answers } = await engine.call("find", { ids: all, estimated: false, frame, intrinsics, focal });
    if (i < warmUp) continue;
    times.push(performance.now() - began);
    found += answers.filter(({ sightings }) => sightings.length > 0).length;
  }
  return { targets: all.length, ...summary(times), found_a_frame: found / frames.length };
}

/** On the page: two followed at once, a third missing. */
async function measureTracking([prints, files, camera, warmUpS, seconds]) {
  const sft = await deepsft.DeepSft.load();
  for (const [i, { name, widthMm }] of prints.entries()) await sft.addPicture(blobOf(files[i]), { widthMm, name });
  const video = document.body.appendChild(document.createElement("video"));
  const stream = await deepsft.openCamera(video);
  const frames = [];
  const session = sft.follow(video, { camera });
  setTimeout(() => session.close(), 1000 * (warmUpS + seconds));
  for await (const { targets, times, networkFps } of session) {
    const followed = targets.filter(({ found, held }) => found && !held).length;
    frames.push({ at: performance.now(), followed, trackMs: times.trackMs, findersPerS: networkFps });
  }
  stream.close();
  const measured = frames.filter(({ at }) => at > frames.at(-1).at - 1000 * seconds);
  const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];
  const lastS = (measured.at(-1).at - measured[0].at) / 1000;
  return {
    seconds: lastS,
    frames_per_s: (measured.length - 1) / lastS,
    both_followed: measured.filter(({ followed }) => followed === 2).length / measured.length,
    track_ms: median(measured.map(({ trackMs }) => trackMs)),
    finders_per_s: median(measured.map(({ findersPerS }) => findersPerS)),
    longest_gap_ms: Math.max(...measured.slice(1).map(({ at }, i) => at - measured[i].at)),
  };
}

const folder = await mkdtemp(join(tmpdir(), "deepsft-bench-"));
try {
  const { camera, shown, pngs } = await twoPrints(folder, FRAMES);
  const film = join(folder, "camera.y4m");
  await writeFile(film, y4m(thereAndBack(shown), CAMERA_FPS));
  const load = [loadavg()[0]];
  await onPage({ webgpu: false, camera: film, permissions: ["camera"], prepare: inWorker(KEEP_MEMORY) }, async ({ page }) => {
    await page.evaluate(share);
    const poster = await readFile(join(ROOT, "models", "poster-a4", "template", "texture.png"), "base64");
    const adding = await page.evaluate(measureAdding, [poster, pngs[0], ADDED]);

    const prints = [...PRINTS, ...Array.from({ length: COUNTS.at(-1) - PRINTS.length }, (_, i) => ({ width: 1020, height: 680, seed: 100 + i, widthMm: 150 }))];
    const files = prints.map((print) => encodePng(makePrint(print)).toString("base64"));
    const stills = Array.from({ length: LOOKED_AT }, (_, i) => shown[Math.floor((i * FRAMES) / LOOKED_AT)].picture);
    await page.evaluate(startFinding, stills.map((still) => encodePng({ ...still, values: still.rgb }).toString("base64")));
    const memoryMb = async () => (await wasmBytes(page)).reduce((sum, bytes) => sum + bytes) / 1e6;
    const finding = { empty_memory_mb: await memoryMb(), at_once: [] };
    for (const [i, count] of COUNTS.entries()) {
      const more = [COUNTS[i - 1] ?? 0, count];
      const widths = prints.map(({ widthMm }) => widthMm);
      await page.evaluate(addTargets, [files.slice(...more), widths.slice(...more)]);
      const added_memory_mb = await memoryMb();
      const measured = await page.evaluate(measureFinding, [camera, WARM_UP, null]);
      finding.at_once.push({ ...measured, added_memory_mb, memory_mb: await memoryMb() });
    }
    finding.one_that_is_not_there = await page.evaluate(measureFinding, [camera, WARM_UP, [3]]);
    await page.evaluate(() => engine.terminate(new Error("measured")));

    const tracking = await page.evaluate(measureTracking, [PRINTS, pngs, camera, WARM_UP_S, seconds]);
    load.push(loadavg()[0]);
    const browser = await page.evaluate(() => navigator.userAgent);
    const rounded = (key, value) => (typeof value === "number" ? Number(value.toPrecision(3)) : value);
    const machine = { browser, cores: availableParallelism(), load_before_and_after: load };
    console.log(JSON.stringify({ ...machine, adding, finding, tracking }, rounded, 2));
  });
} finally {
  await rm(folder, { recursive: true, force: true });
}
