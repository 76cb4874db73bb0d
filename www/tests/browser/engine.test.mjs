// What keeps the engine running, and how it ends: lost GPUs, workers that crash or fall silent, downloads that fail, images
// that cannot be had.

import assert from "node:assert/strict";
import { createServer } from "node:http";
import { join } from "node:path";
import { test } from "node:test";

import { WWW, serve } from "../../serve.mjs";
import { SLOW_MS, launch } from "../support/browser.mjs";
import { BLANK, REAL_GPU, inWorker, loseGpu, onPage } from "../support/page.mjs";

/** For {@link inWorker}: counts what is asked of the GPU, as `calls`. */
const COUNTING = `
  self.calls = {};
  const count = ({ prototype }, name) => {
    const { [name]: call } = prototype;
    prototype[name] = function (...given) {
      self.calls[name] = (self.calls[name] ?? 0) + 1;
      return call.apply(this, given);
    };
  };
  count(GPUQueue, "submit");
  count(GPUBuffer, "mapAsync");
  for (const made of ["createBuffer", "createBindGroup", "createComputePipeline", "createShaderModule"]) count(GPUDevice, made);
`;

// On one page: each start of the engine compiles its shaders, for which a software GPU takes five seconds.
test("on a GPU", { timeout: 2 * SLOW_MS }, (t) =>
  onPage({ prepare: inWorker(REAL_GPU + COUNTING) }, async ({ page }) => {
    await page.evaluate(async () => {
      globalThis.sft = await deepsft.DeepSft.load("/models/poster-a4/");
      globalThis.picture = poster(sft);
      // Time goes on as the test has it.
      let passed = Date.now();
      Date.now = () => passed;
      globalThis.passMs = (ms) => void (passed += ms);
    });
    const estimate = () =>
      page.evaluate(async () => {
        const { found } = await sft.estimate(picture);
        return { found, device: sft.info.device, fallback: sft.info.fallback?.code };
      });
    const onGpu = { found: true, device: "webgpu", fallback: undefined };

    await t.test("a frame is one submission, and nothing is made for it", async () => {
      assert.deepEqual(await estimate(), onGpu);
      const [worker] = page.workers();
      const made = await worker.evaluate(() => self.calls);
      assert.ok(made.createComputePipeline > 10 && made.createBuffer > 10, JSON.stringify(made));
      await worker.evaluate(() => void (self.calls = {}));
      for (let frame = 0; frame < 3; frame++) await estimate();
      assert.deepEqual(await worker.evaluate(() => self.calls), { submit: 3, mapAsync: 3 });
    });

    await t.test("a mesh that is fitted while the GPU is lost is fitted all the same", async () => {
      await page.evaluate(async () => (globalThis.seen = await sft.estimate(picture)) && undefined);
      await loseGpu(page);
      const vertices = await page.evaluate(async () => {
        // The estimate finds out that the GPU is lost, and its worker takes along what else it was asked for.
        const estimate = sft.estimate(picture);
        await new Promise((resolve) => setTimeout(resolve, 5));
        const [mesh] = await Promise.all([seen.completeMesh(), estimate]);
        return mesh.vertices.length;
      });
      assert.ok(vertices > 100);
      assert.deepEqual(await estimate(), onGpu);
    });

    await t.test("one that is lost is started again, and one that is lost soon after each start gives way to the CPU", async () => {
      // It was lost once, above, soon after its start: what lies before a loss that comes later is forgotten, and two in a row may be chance.
      for (const [loss, afterMs] of [70_000, 0, 50_000].entries()) {
        await page.evaluate((ms) => passMs(ms), afterMs);
        await loseGpu(page);
        assert.deepEqual(await estimate(), onGpu, `loss ${loss}`);
      }
      await loseGpu(page);
      assert.deepEqual(await estimate(), { found: true, device: "cpu", fallback: "gpu-lost" });
      assert.equal(page.workers().length, 1, "the old workers are gone");
    });
  }),
);

test("an adapter without time stamps runs the engine, and is not asked for them", { timeout: SLOW_MS }, () => {
  const withoutTimestamps = `
    const { prototype } = GPUAdapter;
    const { get: features } = Object.getOwnPropertyDescriptor(prototype, "features");
    const { requestDevice } = prototype;
    self.asked = [];
    Object.defineProperty(prototype, "features", {
      configurable: true,
      get() { return new Set([...features.call(this)].filter((name) => name !== "timestamp-query")); },
    });
    prototype.requestDevice = function (descriptor) {
      self.asked.push(...(descriptor?.requiredFeatures ?? []));
      if (self.asked.includes("timestamp-query")) return Promise.reject(new TypeError("Unsupported feature"));
      return requestDevice.call(this, descriptor);
    };
  `;
  return onPage({ prepare: inWorker(withoutTimestamps) }, async ({ page }) => {
    const { device, found } = await page.evaluate(async () => {
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "webgpu" });
      const { found } = await sft.estimate(poster(sft));
      return { device: sft.info.device, found };
    });
    assert.deepEqual({ device, found }, { device: "webgpu", found: true });
    assert.equal(await page.workers()[0].evaluate(() => self.asked.includes("timestamp-query")), false);
  });
});

/** Has the worker do something else when it is asked for an estimate. */
const onEstimate = (script) =>
  inWorker(`
    self.addEventListener("message", (event) => {
      if (event.data.method !== "estimate") return;
      event.stopImmediatePropagation();
      ${script}
    });
  `);

for (const [what, script, words] of [
  ["falls silent", "", /silent for 5 s/],
  ["crashes", 'throw new Error("boom");', /boom/],
]) {
  test(`a worker that ${what} is ended, another one starts, and each call of which both do so says it`, { timeout: SLOW_MS }, () =>
    onPage({ webgpu: false, prepare: onEstimate(script) }, async ({ page }) => {
      const errors = await page.evaluate(async () => {
        const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu", timeoutMs: 5000 });
        const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 48 });
        const calls = [sft.estimate(canvas), sft.estimate(canvas)];
        return Promise.all(calls.map((call) => call.catch(({ name, code, message }) => ({ name, code, message }))));
      });
      for (const { name, code, message } of errors) {
        assert.deepEqual([name, code], ["DeepSftError", "internal"]);
        assert.match(message, words);
      }
      await page.waitForTimeout(200);
      assert.equal(page.workers().length, 1, "the old workers are gone");
    }),
  );
}

/** Runs in a worker: what of the module is called next, by class and method, traps as Rust's panics do, at once or within a promise. */
const trapAtNextCall = async ({ of, method, inPromise }) => {
  // A module of one function, which is `unreachable`.
  const bytes = [0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 7, 5, 1, 1, 116, 0, 0, 10, 5, 1, 3, 0, 0, 11];
  const trap = new WebAssembly.Instance(new WebAssembly.Module(Uint8Array.from(bytes))).exports.t;
  const { [of]: { prototype } } = await import(new URL("/pkg/deepsft_web.js", self.location.origin).href);
  // The panic hook rejects the promise before the trap leaves the module.
  const defect = Object.assign(new Error("a defect"), { code: "internal" });
  const panic = (_, reject) => queueMicrotask(() => (reject(defect), trap()));
  prototype[method] = () => (inPromise ? new Promise(panic) : trap());
};

for (const inPromise of [false, true]) {
  test(`an engine that traps ${inPromise ? "within a promise" : "in a call"} is started again, and knows the targets that were added`, { timeout: SLOW_MS }, () =>
    onPage({ webgpu: false }, async ({ page }) => {
      await page.evaluate(async () => {
        const model = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
        globalThis.picture = poster(model);
        globalThis.sft = await deepsft.DeepSft.load(null);
        await sft.addPicture(model.targets[0].texture, { widthMm: 210 });
        model.close();
      });
      while (page.workers().length > 1) await page.waitForTimeout(50);
      const [worker] = page.workers();
      await worker.evaluate(trapAtNextCall, { of: "Engine", method: "estimate", inPromise });
      assert.equal(await page.evaluate(async () => (await sft.estimate(picture)).found), true);
      assert.equal(page.workers().length, 1);
      assert.notEqual(page.workers()[0], worker);
    }),
  );
}

test("a video is followed on after the modules of finders and tracker have trapped", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page }) => {
    await page.evaluate(async () => {
      globalThis.sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const canvas = Object.assign(document.createElement("canvas"), { width: 640, height: 360 });
      const picture = poster(sft);
      let painted = 0;
      setInterval(() => canvas.getContext("2d").drawImage(picture, painted++ % 2, 0), 100);
      const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream() });
      await video.play();
      globalThis.found = 0;
      const session = sft.follow(video);
      session.addEventListener("lost", () => void (globalThis.found = 0));
      const run = async () => {
        for await (const { found } of session) if (found) globalThis.found++;
      };
      void run().catch((error) => (globalThis.ended = error));
    });
    const isFollowed = () =>
      page.waitForFunction(() => {
        if (globalThis.ended) throw globalThis.ended;
        return found >= 5;
      });
    await isFollowed();
    const workers = page.workers();
    assert.equal(workers.length, 2);
    for (const worker of workers) {
      await worker.evaluate(trapAtNextCall, { of: "Engine", method: "find", inPromise: true });
      await worker.evaluate(trapAtNextCall, { of: "MeshTracker", method: "follow", inPromise: true });
    }
    while (page.workers().some((worker) => workers.includes(worker))) await page.waitForTimeout(50);
    await page.evaluate(() => void (globalThis.found = 0));
    // The other tracker knows nothing of the sheet until the other finders have seen it.
    await isFollowed();
    assert.equal(page.workers().length, 2);
  }),
);

test("workers that cannot be started are errors with a code", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page }) => {
    const [absent, refused] = await page.evaluate(async () => {
      const load = (options) =>
        deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu", ...options }).catch(({ name, code, message }) => ({ name, code, message }));
      const absent = await load({ baseUrl: "/absent/" });
      globalThis.Worker = class {
        constructor(_address, { type }) {
          throw new DOMException(`no ${type} here`, "SecurityError");
        }
      };
      return [absent, await load({})];
    });
    assert.deepEqual([absent.name, absent.code], ["DeepSftError", "engine-load"]);
    assert.match(absent.message, /baseUrl/);
    assert.deepEqual([refused.name, refused.code], ["DeepSftError", "engine-load"]);
    assert.match(refused.message, /no module here/);
    assert.deepEqual(page.workers(), []);
  }),
);

/**
 * A server that answers as `answer` says.
 *
 * @param {(path: string, response: import("node:http").ServerResponse) => void} answer
 */
async function serverThat(answer) {
  const server = createServer((request, response) => {
    response.setHeader("access-control-allow-origin", "*");
    answer(request.url, response);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { origin: `http://localhost:${server.address().port}`, close: () => (server.closeAllConnections(), server.close()) };
}

test("models that are no models are refused in words, whatever is wrong with them", { timeout: SLOW_MS }, async () => {
  const manifests = {
    "/null/model.json": "null",
    "/no-files/model.json": "{}",
    "/null-file/model.json": '{"files":{"a":null}}',
    "/no-size/model.json": '{"files":{"a":{}}}',
    "/text-size/model.json": '{"files":{"a":{"size":"7"}}}',
  };
  const server = await serverThat((path, response) => {
    if (path in manifests) return response.end(manifests[path]);
    // A description that breaks off.
    response.writeHead(200, { "content-length": 1000 }).write('{"files":');
    setTimeout(() => response.destroy(), 100);
  });
  try {
    await onPage({ webgpu: false }, async ({ page }) => {
      const codes = await page.evaluate(
        (urls) => Promise.all(urls.map((url) => codeOf(deepsft.DeepSft.load(url, { device: "cpu" })))),
        [...Object.keys(manifests), "/broken/model.json"].map((path) => server.origin + path.replace("model.json", "")),
      );
      assert.deepEqual(codes, [...Object.keys(manifests).map(() => "model-corrupt"), "model-load"]);
    });
  } finally {
    server.close();
  }
});

test("where one download fails the others end", { timeout: SLOW_MS }, async () => {
  let ended;
  const endless = new Promise((resolve) => (ended = resolve));
  let begun = false;
  const server = await serverThat((path, response) => {
    if (path === "/model.json") return response.end('{"files":{"endless":{"size":9000000000},"absent":{"size":1}}}');
    if (path === "/absent") return void setTimeout(() => response.writeHead(404).end(), begun ? 0 : 500);
    begun = true;
    response.writeHead(200);
    const dripping = setInterval(() => response.write("drip"), 20);
    response.on("close", () => (clearInterval(dripping), ended(true)));
  });
  try {
    await onPage({ webgpu: false }, async ({ page }) => {
      const code = await page.evaluate((url) => codeOf(deepsft.DeepSft.load(url, { device: "cpu" })), `${server.origin}/`);
      assert.equal(code, "model-load");
      assert.equal(begun, true);
      const late = new Promise((resolve) => setTimeout(resolve, 20_000, false));
      assert.equal(await Promise.race([endless, late]), true, "the other download still runs");
    });
  } finally {
    server.close();
  }
});

test("pictures of another origin are an error with a code, also in a tracking", { timeout: SLOW_MS }, async () => {
  const elsewhere = await serve({ folders: { "/": join(WWW, "demo") } });
  try {
    await onPage({ webgpu: false }, async ({ page }) => {
      const codes = await page.evaluate(async (origin) => {
        const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
        const video = Object.assign(document.createElement("video"), { muted: true, loop: true, src: `${origin}/clip.webm` });
        document.body.append(video);
        await video.play();
        const image = Object.assign(new Image(), { src: `${origin}/screenshot.jpg` });
        await image.decode();
        return Promise.all([
          codeOf(sft.estimate(video)),
          codeOf(sft.estimate(image)),
          codeOf(sft.follow(video)[Symbol.asyncIterator]().next()),
        ]);
      }, elsewhere.origin);
      assert.deepEqual(codes, Array(3).fill("image-cross-origin"));
    });
  } finally {
    await elsewhere.close();
  }
});

test("refused cameras and images that never come leave no picture and no listener behind", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page, context }) => {
    const { codes, open } = await page.evaluate(async () => {
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const made = [];
      const { createImageBitmap } = globalThis;
      globalThis.createImageBitmap = async (...options) => {
        const bitmap = await createImageBitmap(...options);
        made.push(bitmap);
        return bitmap;
      };
      // A video that jumps for ever.
      globalThis.jumping = document.createElement("video");
      Object.defineProperty(jumping, "seeking", { get: () => true });
      const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 48 });
      canvas.getContext("2d").fillRect(0, 0, 9, 9);
      const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream(20) });
      const painting = setInterval(() => canvas.getContext("2d").fillRect(0, 0, Math.random() * 64, 9), 20);
      await video.play();
      const camera = { width: 64, height: 48, fx: 0, fy: 1, cx: 1, cy: 1 };
      const codes = [
        await codeOf(sft.estimate(canvas, { camera })),
        await codeOf(sft.follow(video, { camera })[Symbol.asyncIterator]().next()),
        await codeOf(sft.estimate(Object.assign(new Image(), { src: "/never" }))),
        await codeOf(sft.estimate(jumping)),
      ];
      clearInterval(painting);
      // A bitmap that was closed, or sent away, has no size.
      return { codes, open: made.filter(({ width }) => width > 0).length };
    });
    assert.deepEqual(codes, ["camera-intrinsics", "camera-intrinsics", "image-unreadable", "image-unreadable"]);
    assert.equal(open, 0, "pictures that stay in memory");
    const cdp = await context.newCDPSession(page);
    const { result } = await cdp.send("Runtime.evaluate", { expression: "jumping" });
    const { listeners } = await cdp.send("DOMDebugger.getEventListeners", { objectId: result.objectId });
    assert.deepEqual(listeners.map(({ type }) => type), []);
  }),
);

test("frames that cannot be read are passed over", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page }) => {
    const seen = await page.evaluate(async () => {
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const canvas = Object.assign(document.createElement("canvas"), { width: 320, height: 240 });
      const painting = setInterval(() => canvas.getContext("2d").fillRect(0, 0, Math.random() * 320, 240), 30);
      const video = Object.assign(document.createElement("video"), { muted: true, srcObject: canvas.captureStream(20) });
      document.body.append(video);
      await video.play();
      const { createImageBitmap } = globalThis;
      let failures = 0;
      // What browsers say of a video that is interrupted.
      globalThis.createImageBitmap = async (image, ...options) => {
        if (image === video && failures < 3) {
          failures++;
          throw new DOMException("The video element's picture is not available.", "InvalidStateError");
        }
        return createImageBitmap(image, ...options);
      };
      const { value } = await sft.follow(video)[Symbol.asyncIterator]().next();
      clearInterval(painting);
      return [failures, value.number];
    });
    assert.deepEqual(seen, [3, 1]);
  }),
);

// Chromium keeps compiled code for the next visit only of larger modules.
test("the engine is compiled while it is downloaded", { timeout: SLOW_MS }, async () => {
  const server = await serve();
  const browser = await launch({ webgpu: false });
  try {
    const page = await browser.newPage();
    await page.goto(server.origin + BLANK);
    const cdp = await page.context().newCDPSession(page);
    const events = new Set();
    cdp.on("Tracing.dataCollected", ({ value }) => value.forEach(({ name }) => events.add(name)));
    await cdp.send("Tracing.start", { traceConfig: { includedCategories: ["v8.wasm", "disabled-by-default-v8.compile", "disabled-by-default-devtools.timeline"] } });
    const { loadedBytes, totalBytes } = await page.evaluate(async () => {
      const { DeepSft } = await import("/src/index.js");
      let engine;
      const onProgress = (step) => (engine = step.phase === "engine" ? step : engine);
      (await DeepSft.load("/models/poster-a4/", { device: "cpu", onProgress })).close();
      return engine;
    });
    assert.ok(loadedBytes > 1e6 && loadedBytes === totalBytes, "bytes are counted on a copy");
    const complete = new Promise((resolve) => cdp.once("Tracing.tracingComplete", resolve));
    await cdp.send("Tracing.end");
    await complete;
    assert.ok(events.has("v8.wasm.streamFromResponseCallback"), [...events].filter((name) => name.startsWith("v8.wasm")).join());
  } finally {
    await browser.close();
    await server.close();
  }
});
