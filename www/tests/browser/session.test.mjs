// Sessions in a real browser: frames of one's own, components that come and go, and the program of the README as it stands.

import assert from "node:assert/strict";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { WWW } from "../../serve.mjs";
import { SLOW_MS } from "../support/browser.mjs";
import { posterFilm } from "../support/followed-page.mjs";
import { MODEL } from "../support/native.mjs";
import { onPage } from "../support/page.mjs";

const TEXTURE = join(MODEL, "template", "texture.png");
const CYCLES = 25;

let folder;
let camera;
before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-session-"));
    camera = await posterFilm(folder, ["motion"], 24, 10);
  },
  { timeout: SLOW_MS },
);
after(() => rm(folder, { recursive: true, force: true }));

const permissions = ["camera"];

for (const kind of ["canvas", "ImageBitmap", "VideoFrame"]) {
  test(`frames of one's own are followed: ${kind}`, { timeout: SLOW_MS }, () =>
    onPage({ webgpu: false }, async ({ page }) => {
      const seen = await page.evaluate(async (kind) => {
        const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
        const canvas = poster(sft);
        const made = { canvas: async () => canvas, ImageBitmap: () => createImageBitmap(canvas), VideoFrame: async (timestamp) => new VideoFrame(canvas, { timestamp }) }[kind];
        const times = [];
        async function* frames() {
          // Faster than the clock: their own times count.
          for (let i = 0; i < 200; i++) {
            const frame = await made(33_000 * i);
            yield { frame, timeMs: 33 * i };
            frame.close?.();
          }
        }
        const events = [];
        const session = sft.follow(frames());
        for (const name of ["found", "lost", "ended"]) session.addEventListener(name, () => events.push(name));
        for await (const { timeMs, found } of session) {
          times.push(Math.round(timeMs / 33));
          if (found && times.length > 20) break;
        }
        sft.close();
        return { events, times, isEach: times.every((time, i) => time === i) };
      }, kind);
      assert.deepEqual(seen.events, ["found", "ended"]);
      assert.ok(seen.isEach && seen.times.length < 200, `${seen.times}`);
    }),
  );
}

test("components that come and go leave no camera, worker or listener behind, also where they go at once", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false, camera, permissions }, async ({ page }) => {
    await page.evaluate(async (cycles) => {
      const tracks = [];
      const { getUserMedia } = navigator.mediaDevices;
      navigator.mediaDevices.getUserMedia = async (wish) => {
        const stream = await getUserMedia.call(navigator.mediaDevices, wish);
        tracks.push(...stream.getTracks());
        return stream;
      };
      const sft = await deepsft.DeepSft.load();
      const errors = [];
      /** As an effect of React does it; strict mode calls it, its clean-up and it again. */
      const mount = (video, onFrame) => {
        const leaving = new AbortController();
        const { signal } = leaving;
        const run = async () => {
          const camera = await deepsft.openCamera(video, { signal });
          for await (const frame of sft.follow(camera, { signal })) onFrame(frame);
        };
        void run().catch((error) => signal.aborted || errors.push(`${error.code} ${error.message}`));
        return () => leaving.abort();
      };
      const video = document.body.appendChild(Object.assign(document.createElement("video"), { id: "shown" }));
      for (let i = 0; i < cycles; i++) {
        mount(video, () => undefined)();
        const unmount = await new Promise((resolve) => {
          const leave = mount(video, () => setTimeout(resolve, 0, leave));
          if (i % 5 > 0) setTimeout(resolve, 20 * (i % 5), leave);
        });
        unmount();
      }
      await new Promise((resolve) => setTimeout(resolve, 500));
      Object.assign(globalThis, { left: { errors, live: tracks.filter(({ readyState }) => readyState === "live").length, asked: tracks.length, src: video.srcObject }, sft });
    }, CYCLES);
    const left = await page.evaluate(() => left);
    assert.deepEqual({ ...left, asked: left.asked >= CYCLES / 5 }, { errors: [], live: 0, asked: true, src: null });
    while (page.workers().length > 1) await page.waitForTimeout(50);
    const cdp = await page.context().newCDPSession(page);
    const { result } = await cdp.send("Runtime.evaluate", { expression: 'document.querySelector("#shown")' });
    const { listeners } = await cdp.send("DOMDebugger.getEventListeners", { objectId: result.objectId });
    assert.deepEqual(listeners.map(({ type }) => type), []);
  }),
);

test("what is declared with `using` is closed at the end of its block", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false, camera, permissions }, async ({ page }) => {
    // As text: not every Node.js that runs the tests knows the declaration.
    const left = await page.evaluate(`(async () => {
      const video = document.body.appendChild(document.createElement("video"));
      const kept = {};
      {
        using sft = kept.sft = await deepsft.DeepSft.load();
        using stream = await deepsft.openCamera(video);
        using session = kept.session = sft.follow(stream);
        const { value } = await session[Symbol.asyncIterator]().next();
        using frame = kept.frame = value;
        kept.before = [session.closed, frame.frame !== null, video.srcObject !== null];
      }
      const error = await kept.sft.estimate(new ImageData(8, 8)).catch(({ code }) => code);
      return [kept.before, kept.session.closed, kept.frame.frame !== null, video.srcObject !== null, error];
    })()`);
    assert.deepEqual(left, [[false, true, true], true, false, false, "closed"]);
  }),
);

test("the program of the README runs as it stands", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false, camera, permissions }, async ({ page, origin }) => {
    const [, program] = /```js\n(import \{ DeepSft, measureSheet[^]*?)```/.exec(await readFile(join(WWW, "README.md"), "utf8"));
    assert.ok(program.trim().split("\n").length <= 12);
    const texture = await readFile(TEXTURE);
    await page.route("**/page.jpg", (route) => route.fulfill({ body: texture, contentType: "image/png" }));
    await page.route("**/readme.html", (route) =>
      route.fulfill({
        contentType: "text/html",
        body: `<meta charset="utf-8" /><video playsinline muted></video>
          <script type="importmap">{ "imports": { "deepsft": "/src/index.js" } }</script>
          <script type="module">${program}</script>`,
      }),
    );
    await page.goto(`${origin}/readme.html`);
    await page.waitForFunction(() => /^bent by \d+°$/.test(document.title));
  }),
);
