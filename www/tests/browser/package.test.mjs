// The package as a page uses it.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";

let browser;
let demo;

before(
  async () => {
    browser = await launch();
    demo = await openDemo(browser, { expectedErrors: [/404/] });
    // What the tests share: a loaded estimator and a picture to look at.
    await demo.page.evaluate(async () => {
      const deepsft = await import("./src/index.js");
      const progress = [];
      const sft = await deepsft.DeepSft.load("models/poster-a4", {
        device: "cpu",
        onProgress: (step) => progress.push(step),
      });
      const picture = new OffscreenCanvas(640, 480);
      picture.getContext("2d").fillRect(0, 0, 640, 480);
      const codeOf = (promise) =>
        promise.then(
          (value) => `resolved to ${value}`,
          (error) => (error instanceof deepsft.DeepSftError ? error.code : String(error)),
        );
      Object.assign(globalThis, { deepsft, sft, progress, picture, codeOf });
    });
  },
  { timeout: SLOW_MS },
);
after(async () => {
  try {
    await demo?.finish();
  } finally {
    await browser?.close();
  }
});

test("loading reports its progress to the last byte and says what runs where", async () => {
  const { progress, info } = await demo.page.evaluate(() => ({
    progress: globalThis.progress,
    info: globalThis.sft.info,
  }));
  const [engine, model] = ["engine", "model"].map((phase) => progress.filter((step) => step.phase === phase).at(-1));
  assert.ok(engine.loadedBytes > 1e6 && engine.loadedBytes === engine.totalBytes, JSON.stringify(engine));
  assert.ok(model.loadedBytes > 1e5 && model.loadedBytes === model.totalBytes, JSON.stringify(model));
  assert.equal(progress.at(-1).phase, "start");
  assert.equal(info.device, "cpu");
  assert.equal(info.fallback, null);
  assert.ok(info.parameters > 1e5 && info.parameters <= 4e6);
});

test("a model may be files of the page's own, and its server may ask for a header", { timeout: SLOW_MS }, async () => {
  let shown = 0;
  demo.page.on("request", (request) => (shown += Number(request.headers().authorization === "Bearer me")));
  const seen = await demo.page.evaluate(async () => {
    const { deepsft, codeOf } = globalThis;
    const folder = "models/poster-a4/";
    const { files: listed } = await (await fetch(`${folder}model.json`)).json();
    const files = new Map();
    for (const name of ["model.json", ...Object.keys(listed)]) files.set(name, new Uint8Array(await (await fetch(folder + name)).arrayBuffer()));
    const nameOf = async (model, options) => {
      const sft = await deepsft.DeepSft.load(model, { device: "cpu", ...options });
      const { modelName } = sft.info;
      sft.close();
      return modelName;
    };
    // As an input for folders gives them.
    const chosen = [...files].map(([name, bytes]) => Object.defineProperty(new File([bytes], name.split("/").at(-1)), "webkitRelativePath", { value: `my-model/${name}` }));
    return {
      names: [await nameOf(files), await nameOf(chosen), await nameOf(folder, { keep: false, headers: { authorization: "Bearer me" } })],
      without: await codeOf(deepsft.DeepSft.load(new Map([...files].slice(1)))),
      files: files.size,
      broken: await codeOf(deepsft.DeepSft.load(new Map([...files].slice(0, 1)))),
    };
  });
  assert.deepEqual(seen, { names: Array(3).fill("poster-a4"), without: "model-load", files: shown, broken: "model-corrupt" });
});

test("every kind of image is accepted and gives maps of 480 x 270", { timeout: SLOW_MS }, async () => {
  const kinds = await demo.page.evaluate(async () => {
    const { sft, picture } = globalThis;
    const blob = await picture.convertToBlob();
    const image = new Image();
    image.src = URL.createObjectURL(blob);
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [640, 480];
    const videoFrame = new VideoFrame(picture, { timestamp: 0 });
    const inputs = {
      OffscreenCanvas: picture,
      HTMLCanvasElement: canvas,
      HTMLImageElement: image,
      ImageBitmap: await createImageBitmap(picture),
      ImageData: picture.getContext("2d").getImageData(0, 0, 640, 480),
      VideoFrame: videoFrame,
      Blob: blob,
    };
    const sizes = {};
    for (const [kind, input] of Object.entries(inputs)) {
      const { depth, registration, mask, camera, times } = await sft.estimate(input);
      sizes[kind] = [
        depth.toFloat32Array().length,
        registration.toFloat32Array().length,
        mask.toFloat32Array().length,
        camera.width,
        times.totalMs > 0,
      ];
    }
    videoFrame.close();
    return sizes;
  });
  assert.equal(Object.keys(kinds).length, 7);
  for (const [kind, sizes] of Object.entries(kinds))
    assert.deepEqual(sizes, [480 * 270, 480 * 270 * 2, 480 * 270, 640, true], kind);
});

test("the caller's image is left as it was", async () => {
  const bytes = await demo.page.evaluate(async () => {
    const data = globalThis.picture.getContext("2d").getImageData(0, 0, 64, 48);
    await globalThis.sft.estimate(data);
    return data.data.length;
  });
  assert.equal(bytes, 64 * 48 * 4);
});

test("cameras that are none are refused by name", async () => {
  const codes = await demo.page.evaluate(() => {
    const { sft, picture, codeOf } = globalThis;
    const camera = { width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240 };
    return Promise.all(
      [
        { fx: 0 },
        { fy: Number.NaN },
        { cx: Number.POSITIVE_INFINITY },
        { distortion: [1, 2] },
        { width: 480, height: 480 },
      ].map((change) => codeOf(sft.estimate(picture, { camera: { ...camera, ...change } }))),
    );
  });
  assert.deepEqual(codes, Array(5).fill("camera-intrinsics"));
});

test("the camera is the caller's, or estimated, and the result says which", async () => {
  const cameras = await demo.page.evaluate(async () => {
    const { sft, picture } = globalThis;
    const given = await sft.estimate(picture, {
      camera: { width: 1280, height: 960, fx: 1000, fy: 1000, cx: 640, cy: 480 },
    });
    const asked = await sft.estimate(picture, {
      camera: (width, height) => ({ width, height, fx: 600, fy: 600, cx: width / 2, cy: height / 2 }),
    });
    const none = await sft.estimate(picture);
    return [given, asked, none].map(({ camera: { fx, source } }) => [fx, source]);
  });
  assert.deepEqual(cameras, [
    [500, "given"],
    [600, "given"],
    [0.79 * 640, "estimated"],
  ]);
});

test("a canvas without pixels, a video without a picture and a broken blob are unreadable images", async () => {
  const codes = await demo.page.evaluate(() => {
    const { sft, codeOf } = globalThis;
    return Promise.all(
      [
        Object.assign(document.createElement("canvas"), { width: 0 }),
        document.createElement("video"),
        new Blob(["no image"]),
        new Image(),
      ].map((input) => codeOf(sft.estimate(input))),
    );
  });
  assert.deepEqual(codes, Array(4).fill("image-unreadable"));
});

test("maps that were closed are not handed out", async () => {
  const error = await demo.page.evaluate(async () => {
    const estimate = await globalThis.sft.estimate(globalThis.picture);
    estimate.close();
    try {
      return String(estimate.depth.toFloat32Array());
    } catch ({ name, code }) {
      return `${name} ${code}`;
    }
  });
  assert.equal(error, "DeepSftError closed");
});

test(
  "an aborted load rejects with the signal's reason, and a module that is not there says how to help",
  { timeout: SLOW_MS },
  async () => {
    const outcomes = await demo.page.evaluate(async () => {
      const { deepsft, codeOf } = globalThis;
      const controller = new AbortController();
      const aborted = deepsft.DeepSft.load("models/poster-a4/", { device: "cpu", signal: controller.signal }).catch(
        (error) => error.name,
      );
      controller.abort();
      const absent = deepsft.DeepSft.load("models/poster-a4/", { baseUrl: "not/here" });
      return [await aborted, await codeOf(absent), await absent.catch((error) => error.message)];
    });
    assert.deepEqual(outcomes.slice(0, 2), ["AbortError", "engine-load"]);
    assert.match(outcomes[2], /not\/here\/deepsft_web_bg\.wasm .* baseUrl/);
  },
);

test("follow follows a video until it is closed", { timeout: SLOW_MS }, async () => {
  const seen = await demo.page.evaluate(async () => {
    const { sft, codeOf } = globalThis;
    // A grey picture with something that moves, so that there are new frames.
    const canvas = Object.assign(document.createElement("canvas"), { width: 320, height: 240 });
    const context = canvas.getContext("2d");
    let turn = 0;
    const paint = () => {
      context.fillStyle = "#888";
      context.fillRect(0, 0, 320, 240);
      context.fillStyle = "#000";
      context.fillRect(turn++ % 300, 100, 20, 20);
    };
    paint();
    const painting = setInterval(paint, 50);
    const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream(20) });
    document.body.append(video);
    await video.play();
    const tracked = [];
    const answers = [];
    const session = sft.follow(video, {
      smooth: { minCutoff: 1 },
      onEstimate: (estimate, frame) => {
        answers.push([estimate.found, frame]);
        estimate.close();
      },
    });
    let maps;
    for await (const one of session) {
      tracked.push([one.number, one.found, one.mesh, one.frame.width, one.camera.source, one.times.trackMs >= 0]);
      if (tracked.length < 3 || answers.length < 2) continue;
      maps = await session.maps();
      session.close();
    }
    const { depth, registration } = maps;
    const camera = { width: 1, height: 9, fx: 1, fy: 1, cx: 0, cy: 0 };
    const answer = {
      tracked: tracked.slice(0, 3),
      answers: answers.slice(0, 2),
      sizes: [depth.length, registration.length, depth.filter((d) => d !== -1).length],
      afterEnd: await codeOf(session.maps()),
      refused: await codeOf(sft.follow(video, { camera })[Symbol.asyncIterator]().next()),
    };
    clearInterval(painting);
    video.remove();
    return answer;
  });
  assert.deepEqual(seen.tracked, [1, 2, 3].map((number) => [number, false, null, 320, "estimated", true]));
  assert.equal(seen.answers[0][1], 1, "the network is asked about the first frame");
  assert.ok(seen.answers[1][1] > 1 && seen.answers.every(([found]) => found === false));
  assert.deepEqual(seen.sizes, [480 * 270, 480 * 270 * 2, 0]);
  assert.deepEqual([seen.afterEnd, seen.refused], ["closed", "camera-intrinsics"]);
});

test("after close() everything rejects, also what was under way", { timeout: SLOW_MS }, async () => {
  const codes = await demo.page.evaluate(async () => {
    const { deepsft, picture, codeOf } = globalThis;
    const sft = await deepsft.DeepSft.load("models/poster-a4/", { device: "cpu" });
    const underWay = codeOf(sft.estimate(picture));
    await new Promise((resolve) => setTimeout(resolve, 5));
    sft.close();
    return [await underWay, await codeOf(sft.estimate(picture))];
  });
  assert.deepEqual(codes, ["closed", "closed"]);
});
