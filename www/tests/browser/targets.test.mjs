// Pictures as targets in the browser: added in the page, found, followed two at once, lost, removed, and refused.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { SLOW_MS } from "../support/browser.mjs";
import { readStamp, stamp, stampPoints } from "../support/barcode.mjs";
import { median } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { KEEP_MEMORY, REAL_GPU, inWorker, loseGpu, onPage, wasmBytes } from "../support/page.mjs";
import { encodePng } from "../support/png.mjs";
import { makePrint } from "../support/prints.mjs";
import { PRINTS, thereAndBack, twoPrints } from "../support/two-prints.mjs";
import { y4m } from "../support/y4m.mjs";

const FRAMES = 30;
/** How often the film goes there and back, and the grey frames at its end. */
const TURNS = 2;
const COVERED = 12;
/** A fifth of the rate that the clips are rendered for, as in tracking.test.mjs. */
const CAMERA_FPS = 6;

let folder;
let shown;
let camera;
let pngs;
let cameraFile;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-targets-"));
    ({ shown, camera, pngs } = await twoPrints(folder, FRAMES));
    const { width, height } = camera;
    const grey = Array.from({ length: COVERED }, () => ({ width, height, rgb: new Uint8Array(3 * width * height).fill(110) }));
    const film = [...Array.from({ length: TURNS }, () => thereAndBack(shown)).flat(), ...grey];
    film.forEach((picture, i) => stamp(picture, i));
    cameraFile = join(folder, "camera.y4m");
    await writeFile(cameraFile, y4m(film, CAMERA_FPS));
  },
  { timeout: SLOW_MS },
);
after(() => rm(folder, { recursive: true, force: true }));

/** The truth of a frame of the film: the meshes of left and right; null while covered. */
function truthOf(film) {
  if (film >= 2 * FRAMES * TURNS) return null;
  const along = film % (2 * FRAMES);
  return shown[along < FRAMES ? along : 2 * FRAMES - 1 - along].vertices;
}

/** Opens an empty page with `sft`, an engine with or without a model, and `pictures`, the prints or others as Blobs. */
const withPictures = ({ model, files = pngs, ...options }, body) =>
  onPage(options, async ({ page, ...rest }) => {
    await page.evaluate(
      async ([files, model]) => {
        globalThis.pictures = files.map((base64) => new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]));
        globalThis.sft = await deepsft.DeepSft.load(model);
      },
      [files, model],
    );
    await body({ page, ...rest });
  });

test("without a model a picture is found, fitted to the image and told from others", { timeout: SLOW_MS }, async () => {
  await withPictures({}, async ({ page }) => {
    const frame = encodePng({ ...shown[0].picture, values: shown[0].picture.rgb }).toString("base64");
    const seen = await page.evaluate(
      async ([prints, base64, camera]) => {
        const none = await codeOf(sft.estimate(new ImageData(64, 64)));
        const targets = [];
        for (const [i, { name, widthMm }] of prints.entries()) targets.push(await sft.addPicture(pictures[i], { widthMm, name }));
        const image = new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]);
        const several = await codeOf(sft.estimate(image, { camera }));
        const found = [];
        for (const target of targets) {
          const estimate = await sft.estimate(image, { camera, target });
          const mesh = await estimate.completeMesh();
          const { by, fitted, times } = estimate;
          const isOfTarget = estimate.target === target;
          found.push({ found: estimate.found, by, fitted, times, isOfTarget, vertices: mesh && [...mesh.vertices], method: mesh?.method });
          estimate.close();
        }
        const [{ id, name, kind, widthMm, heightMm, texture, mesh, grade }] = targets;
        const described = { id, name, kind, widthMm, heightMm, width: texture.width, height: texture.height, grade, faces: mesh.faces.length };
        return { none, several, found, described, model: sft.info.modelName, same: sft.targets.every((target, i) => target === targets[i]) };
      },
      [PRINTS, frame, camera],
    );
    assert.deepEqual([seen.none, seen.several, seen.model, seen.same], ["target-unknown", "target-unknown", null, true]);
    const { faces, ...described } = seen.described;
    const grade = { level: "good", reasons: [] };
    assert.deepEqual(described, { id: 1, name: "left", kind: "picture", widthMm: 150, heightMm: 100, width: 600, height: 400, grade });
    assert.ok(faces > 300);
    assert.deepEqual(seen.found.map(({ found }) => found), [true, true, false]);
    for (const [i, { by, fitted, times, isOfTarget, vertices, method }] of seen.found.slice(0, 2).entries()) {
      assert.deepEqual([by, fitted, isOfTarget, method], ["features", true, true, "fit"]);
      assert.ok(times.featuresMs > 0 && times.networkMs === 0, JSON.stringify(times));
      const { medianPx } = meshDistance(vertices, shown[0].vertices[i]);
      assert.ok(medianPx < 1, `${PRINTS[i].name} is ${medianPx} px off`);
    }
  });
});

test("a print is added by its address, and without its size lengths are counted in its width; a signal leaves nothing behind", { timeout: SLOW_MS }, async () => {
  await withPictures({}, async ({ page }) => {
    const frame = encodePng({ ...shown[0].picture, values: shown[0].picture.rgb }).toString("base64");
    const seen = await page.evaluate(
      async ([{ widthMm }, base64, camera]) => {
        const image = `data:image/png;base64,${base64}`;
        const element = Object.assign(new Image(), { src: URL.createObjectURL(pictures[0]) });
        const look = async (options) => {
          // Not loaded yet the first time.
          const target = await sft.addPicture(element, options);
          const estimate = await sft.estimate(image, { camera, target });
          const { vertices, deviations } = await estimate.completeMesh();
          const depths = estimate.depth.values().filter((d) => d > 0);
          const seen = { unit: target.unit, widthMm: target.widthMm, lengths: [...vertices, ...deviations, ...depths.slice(0, 100)] };
          estimate.close();
          sft.removeTarget(target);
          return seen;
        };
        const [known, unknown] = [await look({ widthMm }), await look()];
        const named = await sft.addPicture("/models/poster-a4/template/texture.png?signed");
        const aborted = new AbortController();
        const adding = sft.addPicture(pictures[1], { signal: aborted.signal }).catch(({ message }) => message);
        const looking = sft.estimate(image, { target: named, signal: aborted.signal }).catch(({ message }) => message);
        aborted.abort(new Error("left"));
        return { known, unknown, name: named.name, reasons: [await adding, await looking], left: sft.targets.length };
      },
      [PRINTS[0], frame, camera],
    );
    assert.deepEqual([seen.known.unit, seen.unknown.unit, seen.name, seen.reasons, seen.left], ["mm", "width", "texture.png", ["left", "left"], 1]);
    assert.ok(Number.isNaN(seen.unknown.widthMm ?? Number.NaN));
    const off = seen.known.lengths.map((mm, i) => Math.abs(mm / PRINTS[0].widthMm - seen.unknown.lengths[i]));
    assert.ok(off.length > 1000 && median(off) < 0.002, `${median(off)} widths`);
  });
});

test(
  "of three pictures before a camera two are followed at once, lost when they are covered, found again, and removed",
  { timeout: SLOW_MS },
  async (t) => {
    await withPictures({ camera: cameraFile, permissions: ["camera"] }, async ({ page }) => {
      await page.evaluate(
        async ([prints, camera, points]) => {
          const targets = [];
          for (const [i, { name, widthMm }] of prints.entries()) targets.push(await sft.addPicture(pictures[i], { widthMm, name }));
          const video = document.body.appendChild(document.createElement("video"));
          globalThis.stream = await deepsft.openCamera(video);
          const canvas = new OffscreenCanvas(64, 8);
          const context = canvas.getContext("2d", { willReadFrequently: true });
          Object.assign(globalThis, { targets, events: [], frames: [] });
          globalThis.session = sft.follow(video, { camera });
          for (const change of ["found", "lost"])
            session.addEventListener(change, ({ detail: { target, frame } }) => {
              events.push({ change, name: target.name, number: frame.number, isSo: frame.of(target).found });
            });
          const run = async () => {
            for await (const tracked of session) {
              const { frame, number, times, found, mesh } = tracked;
              context.drawImage(frame, 0, frame.height - 8, 64, 8, 0, 0, 64, 8);
              const { data } = context.getImageData(0, 0, 64, 8);
              frames.push({
                number,
                at: performance.now(),
                trackMs: times.trackMs,
                greys: points.map(([x]) => data[4 * (4 * 64 + Math.floor(x))]),
                ofFirst: found === tracked.targets[0]?.found && mesh === tracked.targets[0]?.mesh,
                targets: tracked.targets.map(({ target, found, held, mesh, correlation }) => ({
                  name: target.name,
                  ...{ found, held, correlation },
                  vertices: mesh && [...mesh.vertices],
                })),
              });
            }
          };
          // What ends it is the test's to know.
          void run().catch((error) => (globalThis.ended = `${error.code} ${error.message}`));
        },
        [PRINTS, camera, stampPoints(camera.height)],
      );
      // Both found, both lost, both found again, and both followed for a while.
      await page.waitForFunction(
        (least) => {
          const times = (change, name) => events.filter((one) => one.change === change && one.name === name).length;
          const isDone = ["left", "right"].every((name) => times("lost", name) > 0 && times("found", name) > times("lost", name));
          const isClear = ({ found, held }) => found && !held;
          const both = frames.filter(({ targets }) => targets.filter(isClear).length === 2);
          return globalThis.ended || (isDone && both.length >= least);
        },
        FRAMES,
        { timeout: SLOW_MS, polling: 500 },
      );
      const removed = await page.evaluate(async () => {
        const [left, right] = targets;
        const { depth } = await session.maps(right);
        sft.removeTarget(left);
        const from = frames.length;
        while (frames.length < from + 3) await new Promise((resolve) => setTimeout(resolve, 50));
        const names = frames.at(-1).targets.map(({ name }) => name);
        const codes = [await codeOf(sft.estimate(pictures[0], { target: left })), await codeOf(session.maps(left))];
        try {
          sft.removeTarget(left);
        } catch ({ code }) {
          codes.push(code);
        }
        session.close();
        stream.close();
        return { names, codes, area: depth.filter((d) => d > 0).length };
      });
      const { frames, events, ended } = await page.evaluate(() => ({ frames, events, ended: globalThis.ended }));
      assert.equal(ended, undefined);
      assert.deepEqual(removed.names, ["right", "absent"]);
      assert.deepEqual(removed.codes, Array(3).fill("target-unknown"));
      assert.ok(removed.area > 1000, "maps of the one that is named");
      assert.ok(events.every(({ name }) => name !== "absent"), "what is not there is not found");
      assert.ok(events.every(({ change, isSo }) => isSo === (change === "found")), "events agree with their frames");
      assert.ok(frames.every(({ ofFirst }) => ofFirst), "a frame speaks for its first target");
      const stamped = frames.map((frame) => ({ ...frame, film: readStamp(frame.greys) }));
      const errors = [];
      let both = 0;
      for (const { film, targets } of stamped) {
        const truth = truthOf(film);
        const clear = targets.filter(({ found, held }) => found && !held);
        if (truth && clear.length === 2) both++;
        for (const { name, vertices } of clear) {
          assert.ok(truth, `${name} is confirmed by a grey picture`);
          errors.push(meshDistance(vertices, truth[PRINTS.findIndex((print) => print.name === name)]).medianPx);
        }
      }
      const seconds = (frames.at(-1).at - frames[0].at) / 1000;
      t.diagnostic(
        JSON.stringify({
          events: events.map(({ change, name, number }) => `${number} ${change} ${name}`),
          both,
          frames: frames.length,
          fps: frames.length / seconds,
          medianPx: median(errors),
          trackMs: median(frames.map(({ trackMs }) => trackMs)),
        }),
      );
      assert.ok(both > 0.9 * FRAMES, `both in ${both} frames that show them`);
      assert.ok(median(errors) < 1, `${median(errors)} px`);
    });
  },
);

test("beside a model on WebGPU pictures are followed, also after the GPU was lost", { timeout: SLOW_MS }, async () => {
  await withPictures({ model: "/models/poster-a4/", camera: cameraFile, permissions: ["camera"], prepare: inWorker(REAL_GPU) }, async ({ page }) => {
    await page.evaluate(
      async ([prints, camera]) => {
        Object.assign(globalThis, { targets: [], answers: [], numbers: [] });
        for (const [i, { name, widthMm }] of prints.entries()) targets.push(await sft.addPicture(pictures[i], { widthMm, name }));
        globalThis.video = document.body.appendChild(document.createElement("video"));
        globalThis.stream = await deepsft.openCamera(video);
        const onEstimate = (estimate, number) => {
          answers.push({ number, found: estimate.found, kind: estimate.target.kind });
          estimate.close();
        };
        globalThis.session = sft.follow(video, { camera, onEstimate });
        const run = async () => {
          for await (const tracked of session) {
            const clear = [targets[0], targets[1]].map((target) => tracked.of(target)).filter(({ found, held }) => found && !held);
            if (clear.length === 2) numbers.push(tracked.number);
          }
        };
        void run().catch((error) => (globalThis.ended = `${error.code} ${error.message}`));
      },
      [PRINTS, camera],
    );
    /** Both followed in some more frames, and the network asked in between. */
    const followedOn = () =>
      page.evaluate(() => [numbers.length, answers.length]).then((before) =>
        page.waitForFunction(
          ([frames, asked]) => globalThis.ended || (numbers.length >= frames + 5 && answers.length >= asked + 2),
          before,
          { timeout: SLOW_MS, polling: 500 },
        ),
      );
    await followedOn();
    assert.equal(await page.evaluate(() => sft.info.device), "webgpu");
    await loseGpu(page);
    // Removed while the engine is started again.
    await page.evaluate(() => sft.removeTarget(targets[2]));
    await followedOn();
    const frame = encodePng({ ...shown[0].picture, values: shown[0].picture.rgb }).toString("base64");
    const seen = await page.evaluate(
      async ([base64, camera]) => {
        const image = new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]);
        session.close();
        stream.close();
        const found = [];
        for (const target of sft.targets) {
          const estimate = await sft.estimate(image, { target, camera });
          found.push([target.name, estimate.found, estimate.by]);
          estimate.close();
        }
        const removed = await codeOf(sft.estimate(image, { target: targets[2] }));
        return { found, removed, answers, device: sft.info.device, ended: globalThis.ended };
      },
      [frame, camera],
    );
    assert.equal(seen.ended, undefined);
    assert.equal(seen.device, "webgpu", "the GPU was started again");
    assert.ok(seen.answers.every(({ found, kind }) => !found && kind === "model"), "the poster is not there");
    assert.deepEqual(seen.found.slice(1), [["left", true, "features"], ["right", true, "features"]]);
    assert.deepEqual([seen.found[0][1], seen.removed], [false, "target-unknown"]);
  });
});

test("sixteen pictures at once: one is found, and their memory is used again when all are gone", { timeout: SLOW_MS }, async (t) => {
  const others = Array.from({ length: 15 }, (_, i) => encodePng(makePrint({ width: 360, height: 270, seed: 40 + i })).toString("base64"));
  const files = [pngs[0], ...others];
  await withPictures({ files, camera: cameraFile, permissions: ["camera"], prepare: inWorker(KEEP_MEMORY) }, async ({ page }) => {
    const engineMb = async () => (await wasmBytes(page))[0] / 1e6;
    const used = { empty: await engineMb(), full: [] };
    for (let round = 0; round < 3; round++) {
      const seen = await page.evaluate(
        async ([{ widthMm }, camera]) => {
          const targets = [];
          for (const [i, picture] of pictures.entries())
            targets.push(await sft.addPicture(picture, { widthMm: i === 0 ? widthMm : 120, name: `${i}` }));
          const video = document.body.appendChild(document.createElement("video"));
          const stream = await deepsft.openCamera(video);
          const found = new Set();
          let frames = 0;
          for await (const { targets } of sft.follow(video, { camera })) {
            for (const { target, found: isFound } of targets) if (isFound) found.add(target.name);
            if (found.size > 0 && ++frames > 10) break;
          }
          const count = sft.targets.length;
          for (const target of targets) sft.removeTarget(target);
          stream.close();
          video.remove();
          return { count, found: [...found], left: sft.targets.length, none: await codeOf(sft.estimate(pictures[0])) };
        },
        [PRINTS[0], camera],
      );
      assert.deepEqual(seen, { count: 16, found: ["0"], left: 0, none: "target-unknown" });
      while (page.workers().length > 1) await page.waitForTimeout(50);
      used.full.push(await engineMb());
    }
    // What looked like a target takes memory for a fit; that differs from round to round.
    const [first, , third] = used.full;
    t.diagnostic(JSON.stringify(used));
    assert.ok(third - first < 0.5 * (first - used.empty), `${used.empty} MB, then ${used.full}`);
  });
});

test("what cannot be a target is refused with a code and a reason", { timeout: SLOW_MS }, async () => {
  await withPictures({}, async ({ page, origin }) => {
    const refusals = await page.evaluate(async () => {
      const [print] = pictures;
      const canvas = (width, height, style = "#a33") => {
        const made = Object.assign(document.createElement("canvas"), { width, height });
        const context = made.getContext("2d");
        context.fillStyle = style;
        context.fillRect(0, 0, width, height);
        return made;
      };
      const size = { widthMm: 100 };
      const cases = {
        "a height alone": [print, { heightMm: 100 }],
        "zero width": [print, { widthMm: 0 }],
        "negative width": [print, { widthMm: -210 }],
        "a width that is no number": [print, { widthMm: Number.NaN }],
        "a width as a text": [print, { widthMm: "210" }],
        "a width in metres": [print, { widthMm: 0.21 }],
        "an endless width": [print, { widthMm: Infinity }],
        "a height that does not fit": [print, { widthMm: 150, heightMm: 150 }],
        "one pixel": [canvas(1, 1), size],
        "3 x 3": [canvas(3, 3), size],
        "a blank picture": [canvas(600, 400), size],
        "a transparent picture": [canvas(600, 400, "transparent"), size],
        "nothing": [null, size],
        "no image": [new Blob(["text"], { type: "image/png" }), size],
        "an empty file": [new Blob([]), size],
      };
      const answers = {};
      for (const [name, [image, options]] of Object.entries(cases))
        answers[name] = await sft.addPicture(image, options).then(
          () => ["added"],
          ({ code, message }) => [code, message],
        );
      const first = await sft.addPicture(print, { widthMm: 150, name: "first" });
      answers.twice = await sft.addPicture(print, { widthMm: 200 }).catch(({ code, message }) => [code, message]);
      sft.removeTarget(first);
      const again = await sft.addPicture(print, { widthMm: 150, heightMm: 101 });
      const other = await deepsft.DeepSft.load();
      const foreign = await codeOf(other.estimate(print, { target: again }));
      other.close();
      const video = document.createElement("video");
      const ofVideo = (options) => codeOf(Promise.resolve().then(() => sft.follow(video, options)));
      const tracked = [await ofVideo({ targets: [first] }), await ofVideo({ targets: [first, again] })];
      const template = [
        await codeOf(sft.addTemplate("/models/none/")),
        await codeOf(sft.addTemplate(new Map())),
        await codeOf(sft.addTemplate(new Map([["template.json", new TextEncoder().encode("{")]]))),
        await codeOf(sft.addTemplate("/tests/support/")),
      ];
      sft.close();
      return { answers, foreign, tracked, template, closed: await codeOf(sft.addPicture(pictures[1], size)), left: sft.targets.length };
    });
    const { answers } = refusals;
    const unreadable = ["nothing", "no image", "an empty file"];
    for (const [name, [code, message]] of Object.entries(answers)) {
      assert.equal(code, unreadable.includes(name) ? "image-unreadable" : "target-unusable", `${name}: ${message}`);
      assert.match(message, /\.$/);
    }
    assert.match(answers["a width in metres"][1], /mm/);
    assert.match(answers["a transparent picture"][1], /blank/);
    assert.match(answers.twice[1], /"first"/);
    assert.deepEqual([refusals.foreign, ...refusals.tracked], Array(3).fill("target-unknown"));
    assert.deepEqual(refusals.template, ["model-load", "target-unusable", "target-unusable", "model-load"], origin);
    assert.deepEqual([refusals.closed, refusals.left], ["closed", 1]);
  });
});

test("large pictures are made smaller, transparent ones lie on white", { timeout: SLOW_MS }, async () => {
  await withPictures({}, async ({ page }) => {
    const made = await page.evaluate(async () => {
      const bitmap = await createImageBitmap(pictures[0]);
      // 96 megapixels, as scanners make them.
      const large = new OffscreenCanvas(12_000, 8000);
      large.getContext("2d").drawImage(bitmap, 0, 0, 12_000, 8000);
      const blob = await large.convertToBlob({ type: "image/jpeg" });
      const scan = await sft.addPicture(blob, { widthMm: 300 });
      // The right half has no paint at all.
      const canvas = new OffscreenCanvas(600, 400);
      canvas.getContext("2d").drawImage(bitmap, 0, 0, 300, 400, 0, 0, 300, 400);
      const half = await sft.addPicture(new File([await canvas.convertToBlob()], "half.png"), { widthMm: 150 });
      const poor = scan.grade.level === "good" && half.grade;
      const at = ({ data, width }, x, y) => [...data.slice(4 * (y * width + x), 4 * (y * width + x) + 4)];
      return { scan: [scan.texture.width, scan.texture.height, scan.heightMm], half: at(half.texture, 450, 200), name: half.name, poor };
    });
    const { poor, ...rest } = made;
    assert.notEqual(poor.level, "good");
    assert.ok(poor.reasons.length > 0 && poor.reasons.every((reason) => reason.endsWith(".")), poor.reasons.join(" "));
    assert.deepEqual(rest, { scan: [1024, 683, 200], half: [255, 255, 255, 255], name: "half.png" });
  });
});

test("a template's folder is a target like a picture, beside a model and without", { timeout: SLOW_MS }, async () => {
  await withPictures({}, async ({ page }) => {
    const seen = await page.evaluate(async () => {
      const fetched = await sft.addTemplate("/models/poster-a4/template", { name: "poster" });
      const names = ["template.json", "texture.png"];
      const files = await Promise.all(
        names.map(async (name) => new File([await (await fetch(`/models/poster-a4/template/${name}`)).blob()], name)),
      );
      const model = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const chosen = await model.addTemplate(files);
      const image = poster(model);
      const answers = [];
      for (const [engine, target] of [[sft, fetched], [model, chosen], [model, undefined]]) {
        const estimate = await engine.estimate(image, { target });
        answers.push([estimate.found, estimate.by, estimate.target.kind, estimate.target.widthMm]);
        estimate.close();
      }
      const kinds = model.targets.map(({ kind, name }) => `${kind} ${name}`);
      let refusal;
      try {
        model.removeTarget(model.targets[0]);
      } catch ({ code }) {
        refusal = code;
      }
      model.close();
      return { answers, kinds, refusal };
    });
    assert.deepEqual(seen.answers, [
      [true, "features", "template", 297],
      [true, "features", "template", 297],
      [true, "network", "model", 297],
    ]);
    assert.deepEqual(seen.kinds, ["model poster-a4", "template template"]);
    assert.equal(seen.refusal, "target-unusable");
  });
});
