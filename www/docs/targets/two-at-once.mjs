// Makes two-at-once.jpg: two bent prints before Chromium's camera, each with content of its own, and a third that is looked for in
// vain. It is the screenshot of two-at-once.html, which does nothing but use the package; the camera's film is rendered here.
// After `cargo xtask web`:
//
//     node two-at-once.mjs [FILM]    FILM: where to keep the film; used again if it is there

import { existsSync, writeFileSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { serve } from "../../serve.mjs";
import { launch } from "../../tests/support/browser.mjs";
import { encodePng } from "../../tests/support/png.mjs";
import { y4m } from "../../tests/support/y4m.mjs";
import { FOCAL, HEIGHT, SAMPLES, WIDTH, cut, developable, developed, draw, matrix, newImage, sampled } from "../renderer.mjs";

const FRAMES = 40;
const CAMERA_FPS = 10;
/** Where the table is that the shadows fall on, mm. */
const TABLE_MM = 390;

/** `at(t)` is a moment's shape, turn and place; t from 0 to 1 and over again. */
const PRINTS = [
  {
    name: "Postcard",
    widthMm: 148,
    picture: cut(0.02, 0.03, 0.58, 0.58, 900),
    paper: "aurora",
    at: (t) => ({
      bend: developable(0.35 + 0.1 * wave(t), (s) => (0.0075 + 0.0025 * wave(t + 0.2)) * s),
      turned: matrix(0.3 + 0.08 * wave(t), 0.28 + 0.1 * wave(t + 0.3), -0.22 + 0.06 * wave(t)),
      place: [-80 + 5 * wave(t + 0.1), 4 * wave(t), 278],
    }),
  },
  {
    name: "Book cover",
    widthMm: 120,
    picture: cut(0.62, 0.32, 0.975, 0.93, 900),
    paper: "squares",
    at: (t) => ({
      bend: developable(-0.25, (s) => 0.5 * Math.sin(s / (24 + 3 * wave(t)) + 0.8 + 0.5 * wave(t + 0.4))),
      turned: matrix(-0.42 + 0.1 * wave(t + 0.5), 0.2 + 0.08 * wave(t), 0.16 + 0.05 * wave(t + 0.2)),
      place: [83 + 4 * wave(t + 0.6), 6 + 4 * wave(t + 0.3), 305],
    }),
  },
  { name: "Map", widthMm: 120, picture: cut(0.62, 0.03, 0.97, 0.3, 900), paper: "ink" },
];

const wave = (t) => Math.sin(2 * Math.PI * t);

/** How dark the shadows make each pixel of the table, 0 to 1. */
function shadowsOf(surfaces) {
  const cast = { ...newImage([0, 0, 0]), rgb: new Float32Array(3 * WIDTH * HEIGHT * SAMPLES ** 2) };
  for (const surface of surfaces) {
    const fallen = (u, v) => {
      const [x, y, z] = surface(u, v);
      return [x + 0.5 * (TABLE_MM - z), y + 0.6 * (TABLE_MM - z), TABLE_MM];
    };
    draw(cast, fallen, () => [1, 0, 0], [40, 40]);
  }
  const { w, h } = cast;
  let dark = Float32Array.from({ length: w * h }, (_, i) => (cast.rgb[3 * i] > 0 ? 1 : 0));
  // Two box filters along each side are soft enough.
  for (const [lines, length, step, stride] of [[h, w, 1, w], [w, h, w, 1], [h, w, 1, w], [w, h, w, 1]]) dark = blurred(dark, lines, length, step, stride, 22 * SAMPLES);
  return dark;
}

function blurred(values, lines, length, step, stride, radius) {
  const result = new Float32Array(values.length);
  for (let line = 0; line < lines; line++) {
    let sum = 0;
    for (let i = -radius; i < length; i++) {
      if (i + radius < length) sum += values[line * stride + (i + radius) * step];
      if (i - radius > 0) sum -= values[line * stride + (i - radius - 1) * step];
      if (i >= 0) result[line * stride + i * step] = sum / (2 * radius + 1);
    }
  }
  return result;
}

function frameAt(t) {
  const image = newImage([196, 186, 172]);
  const shown = PRINTS.filter(({ at }) => at).map(({ widthMm, picture, at }) => {
    const { bend, turned, place } = at(t);
    const heightMm = (widthMm * picture.height) / picture.width;
    const surface = (u, v) => turned(bend((u - 0.5) * widthMm, (v - 0.5) * heightMm)).map((c, k) => c + place[k]);
    return { surface, picture };
  });
  const dark = shadowsOf(shown.map(({ surface }) => surface));
  for (let i = 0; i < image.rgb.length; i++) image.rgb[i] *= 1 - 0.45 * dark[Math.floor(i / 3)];
  for (const { surface, picture } of shown) draw(image, surface, sampled(picture), [140, 100]);
  const { values, ...size } = developed(image);
  return { ...size, rgb: values };
}

const folder = await mkdtemp(join(tmpdir(), "deepsft-two-"));
const film = process.argv[2] ?? join(folder, "camera.y4m");
if (!existsSync(film)) writeFileSync(film, y4m(Array.from({ length: FRAMES }, (_, i) => frameAt(i / FRAMES)), CAMERA_FPS));
const server = await serve();
const browser = await launch({ webgpu: false, camera: film });
try {
  const context = await browser.newContext({ viewport: { width: 1200, height: 400 }, permissions: ["camera"] });
  const page = await context.newPage();
  page.on("pageerror", (error) => console.error(error));
  await page.goto(`${server.origin}/docs/targets/two-at-once.html`);
  const prints = PRINTS.map(({ name, widthMm, paper, picture }) => ({ name, widthMm, paper, png: encodePng(picture).toString("base64") }));
  const camera = { width: WIDTH, height: HEIGHT, fx: FOCAL, fy: FOCAL, cx: WIDTH / 2, cy: HEIGHT / 2 };
  const seen = await page.evaluate(([prints, camera]) => follow(prints, camera), [prints, camera]);
  console.log(JSON.stringify(seen));
  await page.screenshot({ path: join(dirname(fileURLToPath(import.meta.url)), "two-at-once.jpg"), type: "jpeg", quality: 86 });
} finally {
  await browser.close();
  await server.close();
  await rm(folder, { recursive: true, force: true });
}
