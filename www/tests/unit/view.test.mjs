import assert from "node:assert/strict";
import { test } from "node:test";

import { CANONICAL_HEIGHT, CANONICAL_WIDTH, estimatedCamera, visibleRegion } from "deepsft";
import { softMask } from "../../demo/stage/soft-mask.js";
import { boundsInImage, viewOf } from "../../demo/stage/view.js";

const near = (actual, expected, tolerance = 1e-6) =>
  assert.ok(Math.abs(actual - expected) <= tolerance, `${actual} is not ${expected}`);

test("a landscape image covers a landscape canvas of its shape", () => {
  const view = viewOf({ width: 1920, height: 1080, top: 0, bottom: 0 }, estimatedCamera(1280, 720));
  near(view.scale, 1.5);
  near(view.left, 0);
  near(view.top, 0);
});

test("on a portrait phone a portrait image covers the canvas as far as what the network sees stays in view", () => {
  const camera = estimatedCamera(720, 1280);
  const { scale, left, top } = viewOf({ width: 390, height: 844, top: 60, bottom: 150 }, camera);
  // Covering would take a scale of 844 / 1280 = 0.66. The network sees 480 / 380 * 0.79 = 0.998 of the height, which shall lie in the
  // free 634 pixels, up to 1.12 times.
  near(scale, (1.12 * 634) / (0.79 * (480 / 380) * 1280), 1e-9);
  near(left, (390 - 720 * scale) / 2, 1e-9);
  // 1280 * 0.556 = 711.6 is less than 844, so the image is centred on the free part.
  near(top + (camera.height / 2) * scale, 60 + (844 - 60 - 150) / 2, 1e-9);
});

test("a landscape image on a portrait phone keeps what the network sees within 12 percent of the canvas", () => {
  const camera = estimatedCamera(1280, 720);
  const { scale, left } = viewOf({ width: 390, height: 844, top: 60, bottom: 150 }, camera);
  const region = visibleRegion(camera);
  assert.ok((region.right - region.left) * scale <= 1.12 * 390 + 1e-9);
  assert.ok(left <= 0 && left + camera.width * scale >= 390);
});

test("a mesh is bounded by where the camera shows its vertices, and by the image", () => {
  const camera = { width: 1000, height: 500, fx: 800, fy: 800, cx: 500, cy: 250, distortion: [0, 0, 0, 0, 0] };
  // x = 800 * (-100 / 400) + 500 = 300; y = 800 * (50 / 400) + 250 = 350.
  const box = boundsInImage(Float32Array.of(-100, 50, 400, 0, 0, 400), camera);
  for (const [side, expected] of Object.entries({ left: 300, top: 250, right: 500, bottom: 350 })) near(box[side], expected, 1e-3);
  // At radius r = 0.25 of the normalised plane k1 = 0.4 moves a point outwards by 0.4 r^2 of it: 200 px become 205.
  const distorted = boundsInImage(Float32Array.of(-100, 0, 400, 0, 0, 400), { ...camera, distortion: [0.4, 0, 0, 0, 0] });
  near(distorted.left, 500 - 205, 1e-3);
  const beyond = boundsInImage(Float32Array.of(-900, 0, 400, 900, 900, 400), camera);
  assert.deepEqual([beyond.left, beyond.right, beyond.bottom], [0, 1000, 500]);
});

test("the softened mask keeps its area, is 0 and 255 away from the border and halves at it", () => {
  const mask = new Uint8Array(CANONICAL_WIDTH * CANONICAL_HEIGHT);
  for (let y = 100; y < 180; y++) mask.fill(1, y * CANONICAL_WIDTH + 150, y * CANONICAL_WIDTH + 350);
  const soft = softMask(mask, CANONICAL_WIDTH);
  const at = (x, y) => soft[y * CANONICAL_WIDTH + x];
  assert.equal(at(250, 140), 255);
  assert.equal(at(250, 97), 0);
  // One pixel inside the border: weights 6 + 4 + 1 of 16 are in the mask; one outside: 4 + 1.
  assert.equal(at(150, 140), 176);
  assert.equal(at(149, 140), 80);
  near(soft.reduce((sum, m) => sum + m, 0) / 255 / (80 * 200), 1, 0.01);
});
