// A thing that stands on the sheet, judged by the pixels that the scene draws and by where they must be.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { SurfaceMesh, SurfacePose } from "deepsft";
import { OBJECTS } from "../../demo/objects/objects.js";
import { SCALE } from "../../demo/objects/standing.js";
import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { decodePng } from "../support/png.mjs";
import { cornersOf, depthsOf, inner } from "../support/silhouettes.mjs";

/** All of its image is seen by the network: nothing is dimmed. */
const CAMERA = { width: 640, height: 360, fx: 520, fy: 520, cx: 320, cy: 180, distortion: [0, 0, 0, 0, 0], source: "given" };
const SHEET = { widthMm: 297, heightMm: 210 };
const [COLUMNS, ROWS] = [31, 22];
/** The frame: nothing that stands on the sheet has this hue. */
const FRAME = "#c800c8";
/** What is so little before the sheet or behind it may be seen or not, mm: depth in the buffer, and the bend of the sheet below a flat foot. */
const NEAR_MM = 6;
/** Where the processor draws, the canvas is coarser than the page. */
const REACH_PX = 3;

const TOPOLOGY = (() => {
  const textureCoordinates = Float32Array.from({ length: 2 * COLUMNS * ROWS }, (_, i) => (i % 2 === 0 ? ((i / 2) % COLUMNS) / (COLUMNS - 1) : Math.floor(i / 2 / COLUMNS) / (ROWS - 1)));
  const faces = [];
  for (let i = 0; i < COLUMNS * (ROWS - 1); i++) if (i % COLUMNS < COLUMNS - 1) faces.push(i, i + COLUMNS, i + COLUMNS + 1, i, i + COLUMNS + 1, i + 1);
  return { faces: Uint32Array.from(faces), textureCoordinates };
})();

/** A sheet rolled about its upright axis (towards the viewer where the radius is positive), tilted back, turned aside, and moved away. */
function sheetOf({ radius = Infinity, tilt = 0, turn = 0, distance = 480 }) {
  const vertices = new Float32Array(3 * COLUMNS * ROWS);
  for (let i = 0; i < COLUMNS * ROWS; i++) {
    const [u, v] = TOPOLOGY.textureCoordinates.subarray(2 * i, 2 * i + 2);
    const [s, y] = [(u - 0.5) * SHEET.widthMm, (v - 0.5) * SHEET.heightMm];
    const [x, bend] = radius === Infinity ? [s, 0] : [radius * Math.sin(s / radius), -radius * (1 - Math.cos(s / radius))];
    const [up, depth] = [y * Math.cos(tilt) - bend * Math.sin(tilt), y * Math.sin(tilt) + bend * Math.cos(tilt)];
    vertices.set([x * Math.cos(turn) + depth * Math.sin(turn), up, depth * Math.cos(turn) - x * Math.sin(turn) + distance], 3 * i);
  }
  return new SurfaceMesh({ vertices, confidence: new Float32Array(COLUMNS * ROWS).fill(1) }, TOPOLOGY, "tracking");
}

/** Depths of the sheet and of what stands at (u, v) on it, in each pixel. */
function truth(name, mesh, [u, v]) {
  const pose = new SurfacePose(TOPOLOGY, u, v);
  pose.follow(mesh, 0);
  const [x, y, z, w] = pose.quaternion;
  const rotated = ([a, b, c]) => {
    const [s, t, r] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
    return [a + w * s + y * r - z * t, b + w * t + z * s - x * r, c + w * r + x * t - y * s];
  };
  const scale = SCALE * SHEET.heightMm;
  const object = cornersOf(OBJECTS[name]()).map((corner) => rotated(corner).map((value, k) => pose.position[k] + scale * value));
  const sheet = [...TOPOLOGY.faces].map((vertex) => [...mesh.vertices.subarray(3 * vertex, 3 * vertex + 3)]);
  return { object: depthsOf(object, CAMERA), sheet: depthsOf(sheet, CAMERA) };
}

let browser;
before(async () => (browser = await launch({ webgpu: false })));
after(() => browser?.close());

/** A scene in the page's place, with frames and meshes that are made here; `draw` has it draw an object on a sheet and gives the pixels. */
async function onStage(software, body) {
  const { width, height } = CAMERA;
  const demo = await openDemo(browser, { device: { viewport: { width, height } } });
  const { page } = demo;
  await page.evaluate(
    async ([software, camera, topology, size, color]) => {
      const modules = ["deepsft", "deepsft/scene", "./demo/live/overlays.js", "./src/results/tracked-frame.js"];
      const [{ SurfaceMesh }, { start }, { Overlays }, { TrackedFrame, TrackedTarget }] = await Promise.all(modules.map((name) => import(name)));
      const place = document.createElement("div");
      place.style.cssText = "position: fixed; inset: 0";
      document.body.replaceChildren(place);
      const mesh = { faces: Uint32Array.from(topology.faces), textureCoordinates: Float32Array.from(topology.textureCoordinates) };
      const texture = new ImageData(297, 210);
      // Detail everywhere: what covers it is told by it.
      for (let i = 0; i < texture.data.length; i += 4) texture.data.fill((i / 4) % 2 ? 230 : 160, i, i + 3);
      const target = { kind: "picture", name: "print", unit: "mm", mesh, texture, ...size };
      /** Gives a frame to the scene. */
      let give;
      const session = Object.assign(new EventTarget(), {
        close: () => undefined,
        async *[Symbol.asyncIterator]() {
          for (;;) yield await new Promise((resolve) => (give = resolve));
        },
      });
      const sft = { targets: [target], follow: () => session };
      const view = await start(place, { sft, source: document.createElement("video"), screens: false });
      view.software = software;
      const overlays = new Overlays(view, target, place, new AbortController().signal);
      const pen = new OffscreenCanvas(camera.width, camera.height).getContext("2d");
      pen.fillStyle = color;
      pen.fillRect(0, 0, camera.width, camera.height);
      let number = 0;
      const drawn = () => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      const show = async (surface) => {
        const seen = new TrackedTarget({ target, mesh: surface, held: false, correlation: 1, iterations: 1 });
        while (!give) await drawn();
        give(new TrackedFrame({ number: ++number, timeMs: number, targets: [seen], camera, times: {}, networkFps: 0, frame: await createImageBitmap(pen.canvas) }));
        await drawn();
      };
      globalThis.draw = async ({ name, vertices, seen, tap, overlay = "object", deviations = [], isChosenLater }) => {
        const choice = { overlay, object: name, paper: "aurora" };
        overlays.show(isChosenLater ? { ...choice, overlay: "plain" } : choice);
        const surface = new SurfaceMesh({ vertices: Float32Array.from(vertices), confidence: Float32Array.from(seen), deviations: Float32Array.from(deviations) }, mesh, "tracking");
        // What was known of the sheet before is forgotten.
        await show(null);
        overlays.follow(surface, { near: 0, far: 1, step: 1 });
        await show(surface);
        if (isChosenLater) overlays.show(choice);
        if (tap) place.dispatchEvent(new MouseEvent("click", { clientX: tap[0], clientY: tap[1] }));
        await drawn();
      };
    },
    [software, CAMERA, { faces: [...TOPOLOGY.faces], textureCoordinates: [...TOPOLOGY.textureCoordinates] }, SHEET, FRAME],
  );
  const draw = async (name, mesh, { seen = () => 1, tap, overlay, deviations, isChosenLater } = {}) => {
    const uv = TOPOLOGY.textureCoordinates;
    const covered = Array.from({ length: COLUMNS * ROWS }, (_, i) => seen(uv[2 * i], uv[2 * i + 1]));
    await page.evaluate((what) => draw(what), { name, vertices: [...mesh.vertices], seen: covered, tap, overlay, deviations, isChosenLater });
    await demo.screenshot(`object-${name}-${software ? "software" : "gpu"}`);
    return decodePng(await page.screenshot());
  };
  await body(draw);
  await demo.finish();
}

/** Whether a pixel shows the object; the frame in shadow keeps its hue. */
function isObject({ channels, values }, i) {
  const [r, g, b] = values.subarray(channels * i, channels * i + 3);
  return g > 6 || Math.abs(r - b) > 8;
}

/** Checks which pixels show the object. `hides`: what must hide it, by pixel. */
function check(picture, { object, sheet }, hides = () => false) {
  const shown = [...object.keys()].map((i) => object[i] < sheet[i] + NEAR_MM && object[i] < Infinity && !hides(i));
  const none = [...object.keys()].map((i) => !(object[i] < Infinity) || hides(i) || object[i] > sheet[i] + NEAR_MM);
  const part = (mask) => {
    const pixels = inner(mask, CAMERA, REACH_PX);
    return { count: pixels.length, drawn: pixels.filter((i) => isObject(picture, i)).length / pixels.length };
  };
  const [visible, absent] = [part(shown), part(none)];
  assert.ok(visible.count > 400, `${visible.count} pixels`);
  assert.ok(visible.drawn > 0.99, `${visible.drawn} of what is to be seen is drawn`);
  assert.ok(absent.drawn < 0.001, `${absent.drawn} of all else is drawn over`);
}

for (const software of [false, true]) {
  const by = software ? "the processor" : "a graphics card";
  test(`drawn by ${by}, each object stands on its place, and a tap moves it`, { timeout: SLOW_MS }, () =>
    onStage(software, async (draw) => {
      const mesh = sheetOf({ tilt: -0.9, turn: 0.4 });
      for (const name of Object.keys(OBJECTS)) check(await draw(name, mesh), truth(name, mesh, [0.5, 0.5]));
      const place = [0.3, 0.62];
      const [x, y, z] = mesh.pointAt(...place);
      const tap = [(CAMERA.fx * x) / z + CAMERA.cx, (CAMERA.fy * y) / z + CAMERA.cy];
      check(await draw("house", mesh, { tap }), truth("house", mesh, place));
      // Beside the sheet there is nothing to stand on.
      check(await draw("house", mesh, { tap: [2, 2] }), truth("house", mesh, place));
    }),
  );

  test(`drawn by ${by}, the sheet hides it where it bends in front, and so does what covers the sheet`, { timeout: SLOW_MS }, () =>
    onStage(software, async (draw) => {
      const mesh = sheetOf({ radius: 85, turn: 1.05, distance: 520 });
      const depths = truth("boat", mesh, [0.5, 0.5]);
      const hidden = [...depths.object.keys()].filter((i) => depths.object[i] < Infinity && depths.object[i] > depths.sheet[i] + NEAR_MM);
      assert.ok(hidden.length > 400, `${hidden.length} pixels of it lie behind the sheet`);
      check(await draw("boat", mesh), depths);

      const flat = sheetOf({ tilt: -0.9 });
      const left = truth("house", flat, [0.5, 0.5]);
      // A hand over the sheet's left half.
      const isLeft = (i) => (i % CAMERA.width) + 0.5 < CAMERA.cx && left.sheet[i] < Infinity;
      check(await draw("house", flat, { seen: (u) => (u < 0.5 ? 0 : u > 0.5 ? 1 : 0.5) }), left, isLeft);
    }),
  );

  test(`drawn by ${by}, its shadow darkens the sheet on the side away from the light, and nothing beside it`, { timeout: SLOW_MS }, () =>
    onStage(software, async (draw) => {
      const mesh = sheetOf({ distance: 600 });
      const picture = await draw("boat", mesh);
      const { object, sheet } = truth("boat", mesh, [0.5, 0.5]);
      const red = (i) => picture.values[picture.channels * i];
      const onSheet = inner([...sheet.keys()].map((i) => sheet[i] < Infinity && !(object[i] < Infinity)), CAMERA, REACH_PX);
      const beside = inner([...sheet.keys()].map((i) => !(sheet[i] < Infinity) && !(object[i] < Infinity)), CAMERA, REACH_PX);
      assert.ok(beside.every((i) => Math.abs(red(i) - 0xc8) <= 3), "beside the sheet the frame is as it was");
      const dark = onSheet.filter((i) => red(i) < 0.85 * 0xc8);
      assert.ok(dark.length > 60, `${dark.length} pixels of shadow`);
      // Without a bend the light comes from above on the left.
      const right = dark.filter((i) => (i % CAMERA.width) > CAMERA.cx).length;
      assert.ok(right > 0.8 * dark.length, `${right} of ${dark.length} pixels lie on the right`);
    }),
  );

  test(`drawn by ${by}, plaster is lit from above on the left`, { timeout: SLOW_MS }, () =>
    onStage(software, async (draw) => {
      const greyOf = async (place) => {
        const { channels, width, values } = await draw("house", sheetOf({ distance: 600, ...place }), { overlay: "shaded" });
        const at = channels * (183 * width + 317);
        return (values[at] + values[at + 1] + values[at + 2]) / 3;
      };
      const [flat, toLeft, toRight] = [await greyOf({}), await greyOf({ turn: 0.5 }), await greyOf({ turn: -0.5 })];
      assert.ok(Math.abs(flat - 158) < 12, `${flat}`);
      assert.ok(toLeft > toRight + 20, `${toLeft} where it faces left, else ${toRight}`);
    }),
  );

  test(`drawn by ${by}, the mesh has broken lines where it is loose, also of a frame that was there before it was chosen`, { timeout: SLOW_MS }, () =>
    onStage(software, async (draw) => {
      const uv = TOPOLOGY.textureCoordinates;
      const deviations = Array.from({ length: COLUMNS * ROWS }, (_, i) => (uv[2 * i] < 0.5 ? 1 : 9));
      const { channels, width, values } = await draw("house", sheetOf({ distance: 600 }), { overlay: "mesh", deviations, isChosenLater: true });
      const halves = [0, 0];
      for (let i = 0; channels * i < values.length; i++) {
        // The veil over the frame has no green.
        const [r, g, b] = values.subarray(channels * i, channels * i + 3);
        if (g > 120 && b > 0.6 * g && r < g) halves[Number(i % width >= width / 2)]++;
      }
      const [sure, loose] = halves;
      assert.ok(sure > 300 && loose > 0.3 * sure && loose < 0.7 * sure, `${loose} of ${sure} pixels`);
    }),
  );
}
