// `deepsft/scene` in a page: what it draws, judged by its pixels and the truth of the picture that it looks at, what it says, and what it
// leaves behind.

import assert from "node:assert/strict";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { build } from "vite";

import { ROOT, WWW } from "../../serve.mjs";
import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { MADE, made } from "../support/native.mjs";
import { decodePng } from "../support/png.mjs";
import { HAND, colorAt, isGreen, isMagenta, openScene, shownSheet } from "../support/scenes.mjs";
import { inPose } from "../support/true-sheet.mjs";

const PICTURE = "/models/poster-a4/template/texture.png";

let clip;
let sheet;
let browser;

before(
  async () => {
    ({ clip, sheet } = await shownSheet());
    browser = await launch({ webgpu: false, testCameras: 1 });
  },
  { timeout: SLOW_MS },
);
after(async () => {
  await browser?.close();
});

/** @param {Parameters<typeof openScene>[2]} body */
const onScene = (body, options, shown = clip) => openScene(browser, { shown, hand: sheet.project(sheet.at(0.5, 0.5)).slice(0, 2) }, body, options);
const colorOf = (picture, point) => colorAt(picture, sheet, point);

/** Places on the print that the camera sees: nothing of the sheet lies before them. */
function places() {
  const depths = sheet.depths();
  const all = [];
  for (let u = 0.06; u < 1; u += 0.08) for (let v = 0.06; v < 1; v += 0.08) all.push([u, v]);
  return all.filter(([u, v]) => {
    const [x, y, z] = sheet.project(sheet.at(u, v));
    return z < depths[Math.floor(y) * clip.camera.width + Math.floor(x)] + 4;
  });
}

test("a print lies on the sheet, hands cover it, and it goes when the sheet is lost", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, shot }) => {
    await page.evaluate(async () => {
      globalThis.ar = await startScene();
      globalThis.told = [];
      for (const name of ["found", "lost"]) ar.addEventListener(name, ({ type, detail }) => told.push([type, detail.sheet === ar.sheet()]));
      await ar.sheet().print(halves());
      await until(() => ar.sheet().visible);
      await drawn(ar, 8);
    });
    const seen = places();
    const right = (picture, [u, v]) => (u < 0.5 ? isMagenta : isGreen)(colorOf(picture, sheet.at(u, v)));
    const share = (picture, some) => some.filter((place) => right(picture, place)).length / some.length;
    const printed = share(await shot("print"), seen);
    assert.ok(printed > 0.93, `${printed} of ${seen.length} places have their colour`);

    await page.evaluate(async () => {
      source.hand = true;
      await drawn(ar, 14);
    });
    const [cx, cy] = sheet.project(sheet.at(0.5, 0.5));
    const offMiddle = ([u, v]) => Math.hypot(sheet.project(sheet.at(u, v))[0] - cx, sheet.project(sheet.at(u, v))[1] - cy);
    const covered = await shot("print-hand");
    const under = seen.filter((place) => offMiddle(place) < 0.6 * HAND);
    const beside = seen.filter((place) => offMiddle(place) > 1.5 * HAND);
    assert.ok(under.length >= 5 && beside.length > 20, `${under.length} places under the hand, ${beside.length} beside it`);
    assert.ok(share(covered, under) < 0.2, `${share(covered, under)} of the print is over the hand`);
    assert.ok(share(covered, beside) > 0.9, `${share(covered, beside)} of the print is beside it`);

    // Something else in the same canvas, then the print as it is.
    await page.evaluate(async () => {
      source.hand = false;
      await ar.sheet().print(null);
      await drawn(ar, 2);
    });
    assert.ok(share(await shot(), seen) < 0.5);
    await page.evaluate(async () => {
      source.grey = true;
      await until(() => !ar.sheet().visible);
    });
    assert.deepEqual(await page.evaluate(() => told), [["found", true], ["lost", true]]);
    // Who looks for it is told what to do.
    await page.waitForSelector("#ar > [data-deepsft=scanning] > [role=status]");
    await shot("scanning");
    await page.evaluate(() => ar.close());
    assert.deepEqual(await page.evaluate(() => [document.querySelector("#ar").childElementCount, ar.closed]), [0, true]);
  }),
);

test("a print goes around a tube, and what is behind it is not seen through it", { timeout: SLOW_MS }, async () => {
  const size = { widthMm: 297, heightMm: 210, aroundMm: 91.4 };
  const template = await made("template", "new", "--image", { input: join(ROOT, PICTURE) }, "--size-mm", "297x210", "--around-mm", String(size.aroundMm));
  const tube = await makeClip({ event: "motion", frames: 1, seed: 9_000_001, scale: 2, template });
  await onScene(
    async ({ page, shot }) => {
      const [uv, faces] = await page.evaluate(async (size) => {
        globalThis.ar = await startScene(size);
        await ar.sheet().print(halves());
        await until(() => ar.sheet().visible);
        await drawn(ar, 8);
        const { textureCoordinates, faces } = ar.sheet().target.mesh;
        return [[...textureCoordinates], [...faces]];
      }, size);
      const { vertices } = tube.frames[0];
      const corner = (v) => [0, 1, 2].map((axis) => vertices[3 * v + axis]);
      const minus = (a, b) => a.map((value, axis) => value - b[axis]);
      const dot = (a, b) => a.reduce((sum, value, axis) => sum + value * b[axis], 0);
      const picture = await shot("tube");
      let [right, all] = [0, 0];
      for (let f = 0; f < faces.length; f += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => corner(faces[f + k]));
        const [p, q] = [minus(b, a), minus(c, a)];
        const normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        // It looks at the camera, and lies on one half of the print.
        const u = uv[2 * faces[f]];
        if (dot(normal, a) > -0.4 * Math.hypot(...normal) * Math.hypot(...a) || Math.abs(u - 0.5) < 0.06 || u < 0.03 || u > 0.93) continue;
        all++;
        if ((u < 0.5 ? isMagenta : isGreen)(colorOf(picture, a))) right++;
      }
      assert.ok(all > 200 && right > 0.9 * all, `${right} of ${all} places have their colour`);
      await page.evaluate(() => ar.close());
    },
    {},
    tube,
  );
});

test("an object stands on the sheet in the light of its paper, casts a shadow on it, and hands hide it", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, shot }) => {
    await page.evaluate(async () => {
      globalThis.ar = await startScene();
      const { BoxGeometry, Mesh, MeshStandardMaterial } = three;
      globalThis.box = new Mesh(new BoxGeometry(0.05, 0.06, 0.05), new MeshStandardMaterial({ color: 0xd020d0, roughness: 1 }));
      box.position.y = 0.03;
      ar.sheet().anchor(0.5, 0.5, { unit: "m", smooth: false }).add(box);
      await until(() => ar.sheet().visible);
      await drawn(ar, 12);
    });
    const pose = sheet.pose(0.5, 0.5);
    const top = inPose(pose, [0, 60, 0]);
    const lit = await shot("object");
    assert.ok(isMagenta(colorOf(lit, top)), `${colorOf(lit, top)} on its top`);
    // Its own light: a white wall would be about as bright as white paper.
    const { directed, everywhere } = await page.evaluate(() => {
      const { directed, everywhere } = ar.sheet().light;
      return { directed: directed.intensity, everywhere: everywhere.intensity };
    });
    assert.ok(directed > 0.2 && everywhere > 0.2 && directed + everywhere < 9, `${directed}, ${everywhere}`);
    // Without the shadow parts of the sheet are brighter, and nothing else has changed.
    await page.evaluate(async () => {
      box.castShadow = false;
      await drawn(ar, 4);
    });
    const bare = await shot("object-without-shadow");
    const brightness = ({ values, channels }, i) => values[channels * i] + values[channels * i + 1] + values[channels * i + 2];
    const darker = Array.from({ length: 640 * 360 }, (_, i) => brightness(bare, i) - brightness(lit, i));
    const shaded = darker.filter((change) => change > 45).length;
    assert.ok(shaded > 150 && shaded < 12_000, `${shaded} pixels are in the shadow`);
    assert.ok(darker.filter((change) => change < -45).length < shaded / 5, "the rest is as it was");
    await page.evaluate(async () => {
      source.hand = true;
      await drawn(ar, 14);
    });
    const hidden = await shot("object-hand");
    const foot = inPose(pose, [0, 20, 26]);
    assert.ok(isMagenta(colorOf(lit, foot)) && !isMagenta(colorOf(hidden, foot)), `${colorOf(hidden, foot)} before the hand`);
    await page.evaluate(() => ar.close());
  }),
);

test("a film plays while the sheet is found, its sound by a tap, and what is seen can be kept", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, shot }) => {
    await page.evaluate(async () => {
      // A film with a tone, as a file.
      const canvas = Object.assign(document.createElement("canvas"), { width: 160, height: 112 });
      const pen = canvas.getContext("2d");
      const paint = setInterval(() => Object.assign(pen, { fillStyle: `hsl(300 90% ${50 + Math.random()}%)` }).fillRect(0, 0, 160, 112), 30);
      const audio = new AudioContext();
      const [tone, out] = [audio.createOscillator(), audio.createMediaStreamDestination()];
      tone.connect(out);
      tone.start();
      const stream = new MediaStream([...canvas.captureStream(20).getTracks(), ...out.stream.getTracks()]);
      const recorder = new MediaRecorder(stream, { mimeType: "video/webm" });
      const parts = [];
      recorder.ondataavailable = ({ data }) => parts.push(data);
      recorder.start();
      await new Promise((resolve) => setTimeout(resolve, 3000));
      const stopped = new Promise((resolve) => (recorder.onstop = resolve));
      recorder.stop();
      await stopped;
      clearInterval(paint);
      await audio.close();
      globalThis.ar = await startScene();
      await ar.sheet().print(new File(parts, "film.webm", { type: "video/webm" }));
      await until(() => ar.sheet().visible && !ar.sheet().video.paused);
      await drawn(ar, 8);
    });
    assert.ok(isMagenta(colorOf(await shot("film"), sheet.at(0.3, 0.5))));
    const film = () => page.evaluate(() => (({ muted, paused, loop, playsInline }) => ({ muted, paused, loop, playsInline }))(ar.sheet().video));
    assert.deepEqual(await film(), { muted: true, paused: false, loop: true, playsInline: true });
    const sound = page.getByRole("button", { name: "Sound" });
    await sound.click();
    assert.deepEqual([(await film()).muted, await sound.getAttribute("aria-pressed")], [false, "true"]);

    const kept = await page.evaluate(async () => {
      const recording = ar.record();
      await drawn(ar, 12);
      const [png, video] = [await ar.shot(), await recording.stop()];
      const picture = await createImageBitmap(png);
      const played = Object.assign(document.createElement("video"), { src: URL.createObjectURL(video), muted: true });
      await new Promise((resolve) => (played.onloadeddata = resolve));
      const bytes = new Uint8Array(await png.arrayBuffer());
      return { png: [...bytes], size: [picture.width, picture.height], video: [played.videoWidth, played.videoHeight], bytes: video.size };
    });
    assert.deepEqual([kept.size, kept.video], [[640, 360], [640, 360]]);
    assert.ok(kept.bytes > 2000, `${kept.bytes} bytes`);
    assert.ok(isMagenta(colorOf(decodePng(Buffer.from(kept.png)), sheet.at(0.3, 0.5))));

    await page.evaluate(async () => {
      source.grey = true;
      await until(() => ar.sheet().video.paused);
      source.grey = false;
      await until(() => !ar.sheet().video.paused);
      const [first, second] = [ar.sheet().print("/demo/icon.png"), ar.sheet().print("/nowhere.mp4")];
      globalThis.outcomes = await Promise.all([first, second].map((print) => print.then(() => "printed", ({ name, code }) => code === 20 ? name : code)));
    });
    // The film before stays where another could not be had.
    assert.deepEqual(await page.evaluate(() => [outcomes, ar.sheet().video.paused, document.querySelectorAll("video").length]), [["AbortError", "image-unreadable"], false, 2]);
    // What the browser does not play as it comes is fetched whole.
    await page.route("**/whole.webm", (route) => (route.request().resourceType() === "media" ? route.abort() : route.fulfill({ path: join(WWW, "demo", "clip.webm") })));
    await page.evaluate(async () => {
      await ar.sheet().print("/whole.webm");
      await until(() => ar.sheet().video.currentTime > 0.2);
    });
    await page.evaluate(() => ar.close());
    assert.equal(await page.locator("video").count(), 0);
  }, { expectedErrors: [/404/, /ERR_FAILED/] }),
);

test("a camera that is refused is explained, and tried again", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, demo }) => {
    const codes = await page.evaluate(async () => {
      const codes = [];
      globalThis.ar = await startScene({ source: undefined });
      await new Promise((resolve) => ar.addEventListener("error", ({ detail: { error } }) => (codes.push(error.code), resolve())));
      return [...codes, ar.error.code];
    });
    assert.deepEqual(codes, ["camera-denied", "camera-denied"]);
    await demo.screenshot("scene-refused");
    assert.match(await page.textContent("[role=alert]"), /^The camera was not allowed\./);
    await demo.context.grantPermissions(["camera"]);
    await page.getByRole("button", { name: "Try again" }).click();
    // The browser's test picture has no print.
    await page.waitForSelector("[data-deepsft=scanning]");
    assert.equal(await page.evaluate(() => ar.error), null);
    await page.evaluate(() => ar.close());

    // What fails before there is a scene is said in its place, until another one starts there.
    const code = await page.evaluate(() => startScene({ picture: "/nowhere.png" }).catch(({ code }) => code));
    assert.equal(code, "image-unreadable");
    assert.match(await page.textContent("#ar [role=alert]"), /nowhere\.png could not be fetched/);
    const own = await page.evaluate(async () => {
      const hint = document.body.appendChild(document.createElement("p"));
      const ar = await startScene({ screens: { loading: hint, scanning: ({ targets }) => Object.assign(document.createElement("b"), { textContent: targets.length }) } });
      source.grey = true;
      const states = [[hint.hidden, document.querySelectorAll("[role=alert]").length]];
      await until(() => document.querySelector("#ar b"));
      states.push([hint.hidden, document.querySelector("#ar b").textContent]);
      ar.close();
      hint.remove();
      return states;
    });
    assert.deepEqual(own, [[false, 0], [true, "1"]]);
    await assert.rejects(page.evaluate(() => scene.start("#nothing")), /DeepSftError: The page has no element #nothing/);
  }, { expectedErrors: [/404/] }),
);

/** On the page: a camera that shows the picture of `prepare`, and how many are open. */
function showPicture() {
  // The page before the first has no cameras.
  if (!navigator.mediaDevices) return;
  globalThis.opened = [];
  MediaDevices.prototype.getUserMedia = async () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 960, height: 540 });
    setInterval(() => globalThis.cameraPicture && canvas.getContext("2d").drawImage(cameraPicture, 0, 0), 60);
    const stream = canvas.captureStream(15);
    opened.push(...stream.getTracks());
    return stream;
  };
}
const playsFilm = () => [...document.querySelectorAll("video")].some(({ src, currentTime, paused }) => src && currentTime > 0.2 && !paused);

/** Waits until the last worker has ended. @param {import("playwright-core").Page} page */
async function noWorkers(page) {
  const end = Date.now() + 10_000;
  while (page.workers().length > 0 && Date.now() < end) await new Promise((resolve) => setTimeout(resolve, 100));
  assert.equal(page.workers().length, 0);
}

/** The clip's picture, for {@link showPicture}. */
async function takePicture(png) {
  const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
  globalThis.cameraPicture = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
}

test("a print laid flat is the picture again, and a hand on it has no confidence", { timeout: SLOW_MS }, () =>
  onScene(async ({ page }) => {
    /** Correlation of the flat print with the picture where it is confident, and how much it is confident of: of all, and of the hand's middle. */
    const measured = await page.evaluate(async (picture) => {
      globalThis.ar = await startScene();
      // What is printed in its place is not of the camera's picture.
      await ar.sheet().print(halves());
      const early = await ar.sheet().flatten();
      const texture = await createImageBitmap(await (await fetch(picture)).blob());
      const compared = async (unshaded = false) => {
        const { image, confidence } = await ar.sheet().flatten({ width: 300, unshaded });
        const canvas = new OffscreenCanvas(image.width, image.height);
        const pen = canvas.getContext("2d");
        Object.assign(pen, { imageSmoothingQuality: "high" }).drawImage(texture, 0, 0, image.width, image.height);
        const { data } = pen.getImageData(0, 0, image.width, image.height);
        const pairs = [];
        confidence.forEach((c, i) => c > 0 && pairs.push([image.data[4 * i + 1], data[4 * i + 1]]));
        const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
        const [a, b] = [0, 1].map((k) => mean(pairs.map((pair) => pair[k])));
        const product = (f) => mean(pairs.map(([x, y]) => f(x - a, y - b)));
        const correlation = product((x, y) => x * y) / Math.sqrt(product((x) => x * x) * product((_, y) => y * y));
        const middle = [...confidence].filter((_, i) => Math.hypot((i % 300) - 150, Math.floor(i / 300) - image.height / 2) < 15);
        return { size: [image.width, image.height], correlation, shown: pairs.length / confidence.length, middle: mean(middle.map((c) => Number(c > 0))), off: mean(pairs.map(([x, y]) => Math.abs(x - y))) };
      };
      await until(() => ar.sheet().visible);
      const [open, even] = [await compared(), await compared(true)];
      source.hand = true;
      await drawn(ar, 14);
      return { early, open, even, hand: await compared() };
    }, PICTURE);
    const { early, open, even, hand } = measured;
    assert.equal(early, null, "before the first frame");
    assert.deepEqual(open.size, [300, 212]);
    assert.ok(open.correlation > 0.9 && open.shown > 0.8 && open.middle === 1, JSON.stringify(open));
    assert.ok(even.off < 0.8 * open.off && even.correlation > open.correlation, JSON.stringify({ open, even }));
    assert.ok(hand.middle < 0.2 && hand.shown < open.shown, JSON.stringify(hand));
    await assert.rejects(page.evaluate(() => ar.sheet().flatten({ width: 5 })), /5 pixels wide/);
  }),
);

test("an element of HTML is a scene while it is in the page, and starts anew with other attributes", { timeout: SLOW_MS }, () =>
  onScene(async ({ page, demo }) => {
    await page.evaluate(showPicture);
    await page.evaluate(takePicture, clip.frames[0].png.toString("base64"));
    await page.evaluate(async () => {
      await import("/src/scene/element.js");
      document.querySelector("#ar").innerHTML = '<deepsft-view picture="/models/poster-a4/template/texture.png" width-mm="297" print="/demo/clip.webm"></deepsft-view>';
      globalThis.view = document.querySelector("deepsft-view");
      globalThis.told = [];
      for (const name of ["started", "found", "lost", "error"]) view.addEventListener(name, ({ type, detail }) => told.push([type, detail.error?.code]));
    });
    await page.waitForFunction(playsFilm);
    await page.waitForFunction(() => told.some(([type]) => type === "found"));
    await demo.screenshot("scene-element");
    assert.deepEqual(await page.evaluate(() => [told.map(([type]) => type), view.view.sheet().target.widthMm]), [["started", "found"], 297]);
    await page.evaluate(() => {
      view.setAttribute("picture", "/nowhere.png");
      view.setAttribute("width-mm", "100");
    });
    await page.waitForFunction(() => told.at(-1)[1] === "image-unreadable");
    await page.evaluate(() => view.remove());
    await page.waitForFunction(() => opened.length > 0 && opened.every(({ readyState }) => readyState === "ended"));
    assert.equal(await page.evaluate(() => view.view), null);
  }, { expectedErrors: [/404/] }),
);

test("a component of React in strict mode has one scene and one camera, and none when it is gone", { timeout: SLOW_MS }, async () => {
  await mkdir(MADE, { recursive: true });
  const app = await mkdtemp(join(MADE, "react-"));
  try {
    await writeFile(join(app, "index.html"), '<!doctype html><link rel="icon" href="data:," /><div id="root"></div><script type="module" src="/main.jsx"></script>');
    await writeFile(
      join(app, "main.jsx"),
      `import { StrictMode } from "react";
       import { createRoot } from "react-dom/client";
       import { Poster } from ${JSON.stringify(join(WWW, "examples", "react", "poster.jsx"))};
       const root = createRoot(document.querySelector("#root"));
       globalThis.leave = () => root.unmount();
       root.render(<StrictMode><Poster picture="/models/poster-a4/template/texture.png" film="/demo/clip.webm" /></StrictMode>);`,
    );
    const alias = { "deepsft/scene": join(WWW, "src", "scene", "index.js"), deepsft: join(WWW, "src", "index.js") };
    // Strict mode mounts twice in development alone.
    await build({ root: app, mode: "development", logLevel: "error", configFile: false, resolve: { alias }, define: { "process.env.NODE_ENV": '"development"' }, build: { outDir: "out", minify: false } });
    const folders = { "/models/": join(ROOT, "models"), "/demo/": join(WWW, "demo"), "/": join(app, "out") };
    const prepare = (context) => context.addInitScript(showPicture);
    const demo = await openDemo(browser, { folders, device: { viewport: { width: 640, height: 360 } }, prepare });
    const { page } = demo;
    await page.evaluate(takePicture, clip.frames[0].png.toString("base64"));
    await page.waitForFunction(playsFilm);
    // Else there is a picture of what is looked for too.
    await page.waitForSelector("[data-deepsft=running]");
    await demo.screenshot("scene-react");
    const counts = () => page.evaluate(() => [document.querySelectorAll("#root [data-deepsft]").length, opened.filter(({ readyState }) => readyState === "live").length]);
    assert.deepEqual(await counts(), [1, 1]);
    assert.equal(await page.evaluate(() => opened.length), 2, "it was mounted twice");
    await page.evaluate(() => leave());
    await page.waitForFunction(() => opened.every(({ readyState }) => readyState === "ended"));
    assert.deepEqual(await counts(), [0, 0]);
    await noWorkers(page);
    await demo.finish();
  } finally {
    await rm(app, { recursive: true, force: true });
  }
});

for (const kind of ["scenes", "elements"]) test(`fifty ${kind} that come and go leave no track, worker, canvas or listener`, { timeout: SLOW_MS }, () =>
  onScene(async ({ page, demo }) => {
    await demo.context.grantPermissions(["camera"]);
    await page.evaluate(async (picture) => {
      await import("/src/scene/element.js");
      globalThis.mount = {
        scenes() {
          const leaving = new AbortController();
          return { started: startScene({ source: undefined, signal: leaving.signal }), leave: () => leaving.abort() };
        },
        elements() {
          const element = document.createElement("deepsft-view");
          element.setAttribute("picture", picture);
          const started = new Promise((resolve) => element.addEventListener("started", ({ detail }) => resolve(detail.view), { once: true }));
          document.querySelector("#ar").append(element);
          return { started, leave: () => element.remove() };
        },
      };
      const { mediaDevices } = navigator;
      const { getUserMedia } = mediaDevices;
      globalThis.tracks = [];
      mediaDevices.getUserMedia = async function (...wanted) {
        const stream = await getUserMedia.apply(this, wanted);
        for (const track of stream.getTracks()) tracks.push(new WeakRef(track));
        return stream;
      };
    }, PICTURE);
    const session = await demo.context.newCDPSession(page);
    await session.send("Performance.enable");
    /** Listeners, and the objects of some kinds that are still reachable. */
    const counts = async () => {
      for (let i = 0; i < 3; i++) await session.send("HeapProfiler.collectGarbage");
      const { metrics } = await session.send("Performance.getMetrics");
      const found = { listeners: metrics.find(({ name }) => name === "JSEventListeners").value };
      for (const kind of ["scene.SceneView", "three.WebGLRenderer", "HTMLVideoElement", "HTMLCanvasElement", "AbortController"]) {
        const { result } = await session.send("Runtime.evaluate", { expression: `${kind}.prototype`, objectGroup: "counted" });
        const { objects } = await session.send("Runtime.queryObjects", { prototypeObjectId: result.objectId, objectGroup: "counted" });
        const functionDeclaration = "function () { return this.length; }";
        found[kind] = (await session.send("Runtime.callFunctionOn", { objectId: objects.objectId, functionDeclaration, returnByValue: true })).result.value;
        await session.send("Runtime.releaseObjectGroup", { objectGroup: "counted" });
      }
      return found;
    };
    /** Mounts and unmounts: as strict mode does, at once; while it starts; once it runs. */
    const comeAndGo = (count) =>
      page.evaluate(async ([count, kind]) => {
        const reasons = [];
        for (let i = 0; i < count; i++) {
          const { started, leave } = mount[kind]();
          started.catch((error) => reasons.push(error.name));
          const stay = [() => 0, () => new Promise((resolve) => setTimeout(resolve, 20 * i)), () => started.then((ar) => drawn(ar, 1))][i % 10 === 9 ? 2 : i % 2];
          await stay();
          leave();
        }
        return reasons;
      }, [count, kind]);
    await comeAndGo(10);
    const before = await counts();
    const reasons = await comeAndGo(50);
    assert.ok((kind === "elements" || reasons.length >= 20) && reasons.every((name) => name === "AbortError"), String(reasons));
    await page.waitForFunction(() => tracks.length > 0 && tracks.every((track) => track.deref()?.readyState !== "live"));
    await noWorkers(page);
    assert.deepEqual(await page.evaluate(() => [document.querySelectorAll("canvas, video").length, document.querySelector("#ar").childElementCount]), [0, 0]);
    // Garbage of three.js's and the browser's own comes with delay.
    let after = await counts();
    const end = Date.now() + 10_000;
    for (; after["scene.SceneView"] > 0 && Date.now() < end; after = await counts()) await new Promise((resolve) => setTimeout(resolve, 500));
    const { listeners, ...held } = after;
    assert.deepEqual(held, { "scene.SceneView": 0, "three.WebGLRenderer": 0, HTMLVideoElement: 0, HTMLCanvasElement: 0, AbortController: 0 });
    // The browser's own come and go; one of each scene would be fifty.
    assert.ok(listeners - before.listeners < 25, `${before.listeners} listeners, then ${listeners}`);
  }),
);
