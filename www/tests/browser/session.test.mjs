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

test("copies of a print are followed, each in its place, where the page asks for them", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page }) => {
    const texture = await readFile(TEXTURE, "base64");
    const seen = await page.evaluate(async (base64) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
      const sft = await deepsft.DeepSft.load();
      const refused = await codeOf(sft.addPicture(image, { widthMm: 297, copies: 0 }));
      const target = await sft.addPicture(image, { widthMm: 297, copies: 3 });
      const canvas = new OffscreenCanvas(960, 540);
      const context = canvas.getContext("2d");
      /** Two prints side by side; later the left one is covered. */
      const draw = (isCovered) => {
        context.fillStyle = "#556";
        context.fillRect(0, 0, 960, 540);
        for (const x of isCovered ? [520] : [40, 520]) context.drawImage(image, x, 130, 400, 282);
      };
      let covered = false;
      async function* frames() {
        for (let i = 0; i < 400; i++) {
          draw(covered);
          yield { frame: canvas, timeMs: 33 * i };
        }
      }
      const events = [];
      const session = sft.follow(frames());
      for (const name of ["found", "lost"]) session.addEventListener(name, ({ detail }) => events.push([name, detail.copy, detail.target === target]));
      let sides = [];
      for await (const frame of session) {
        const copies = frame.copiesOf(target);
        sides = copies.map(({ copy, mesh }) => [copy, mesh && Math.sign(mesh.vertices.reduce((sum, value, i) => sum + (i % 3 === 0 ? value : 0), 0))]);
        if (frame.of(target) !== copies[0]) throw new Error("of() is the first copy");
        if (copies.filter(({ found }) => found).length === 2) covered = true;
        if (events.some(([name]) => name === "lost")) break;
      }
      sft.close();
      return { refused, events, sides };
    }, texture);
    assert.equal(seen.refused, "invalid-argument");
    const found = seen.events.filter(([name]) => name === "found").map(([, copy]) => copy);
    assert.deepEqual(found.toSorted(), [0, 1], JSON.stringify(seen));
    // The one that is covered is lost, and the other stays on the right side.
    assert.equal(seen.events.filter(([name]) => name === "lost").length, 1);
    assert.deepEqual(seen.sides.map(([copy]) => copy), [0, 1, 2]);
    assert.deepEqual(seen.sides.map(([, side]) => side).filter((side) => side !== null), [1], JSON.stringify(seen));
    assert.ok(seen.events.every(([, , isOfTarget]) => isOfTarget));
  }),
);

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
