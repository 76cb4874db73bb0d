import assert from "node:assert/strict";
import { test } from "node:test";

import { isPrintOutline, printAspect, rectifyPicture } from "../../src/targets/rectify.js";

// Node.js has none; the rectification needs its three fields only.
globalThis.ImageData ??= class {
  constructor(width, height) {
    Object.assign(this, { width, height, data: new Uint8ClampedArray(4 * width * height) });
  }
};

const CAMERA = { fx: 790, fy: 790, cx: 500, cy: 375 };

/** Corners of a print of `width` x `height` mm, tilted by some angles about y, then x, `distance` mm away. */
function seen(width, height, [yaw, pitch], distance) {
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i, j]) => {
    const [x, y] = [(i * width) / 2, (j * height) / 2];
    const [x1, z1] = [x * Math.cos(yaw), -x * Math.sin(yaw)];
    const [y2, z2] = [y * Math.cos(pitch) - z1 * Math.sin(pitch), y * Math.sin(pitch) + z1 * Math.cos(pitch)];
    const z = distance + z2;
    return [(CAMERA.fx * x1) / z + CAMERA.cx, (CAMERA.fy * y2) / z + CAMERA.cy];
  });
}

test("a print's proportions come back from its corners, however it is tilted", () => {
  for (const angles of [[0, 0], [0.3, 0], [0, -0.5], [0.6, 0.4], [-0.9, 0.2]])
    for (const [width, height] of [[210, 297], [148, 105], [300, 80]])
      assert.ok(Math.abs(printAspect(seen(width, height, angles, 600), CAMERA) - width / height) < 1e-9 * width);
});

test("the proportions of a print tilted by 17 degrees err little where the focal length is wrong by a fifth", () => {
  for (const factor of [0.8, 1.2]) {
    const wrong = { ...CAMERA, fx: factor * CAMERA.fx, fy: factor * CAMERA.fy };
    const aspect = printAspect(seen(148, 105, [0.3, 0], 400), wrong);
    // cos(17 degrees) is 0.956: no more than the foreshortening itself can be mistaken.
    assert.ok(Math.abs(aspect / (148 / 105) - 1) < 0.045, `${aspect}`);
  }
});

test("a photograph's gradients become the flat picture's", () => {
  // Red and green say where a pixel lies on the print: a homography's inverse by hand would be another program, so the
  // photograph is affine, where (u, v) is linear in (x, y).
  const [width, height] = [320, 240];
  const photograph = new ImageData(width, height);
  const corners = [[40, 30], [240, 50], [280, 210], [80, 190]];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const [dx, dy] = [x + 0.5 - 40, y + 0.5 - 30];
      // (dx, dy) = u (200, 20) + v (40, 160)
      const determinant = 200 * 160 - 40 * 20;
      const [u, v] = [(160 * dx - 40 * dy) / determinant, (200 * dy - 20 * dx) / determinant];
      photograph.data.set([255 * u, 255 * v, 77, 255], 4 * (y * width + x));
    }
  }
  for (const [w, h] of [[100, 80], [30, 20], [300, 240]]) {
    const flat = rectifyPicture(photograph, corners, w, h);
    assert.deepEqual([flat.width, flat.height], [w, h]);
    for (const [x, y] of [[w >> 1, h >> 1], [w >> 2, h >> 1], [w - 4, h - 4], [3, 3]]) {
      const [r, g, b, a] = flat.data.subarray(4 * (y * w + x));
      assert.ok(Math.abs(r - (255 * (x + 0.5)) / w) < 2, `${w} x ${h}: red ${r} in column ${x}`);
      assert.ok(Math.abs(g - (255 * (y + 0.5)) / h) < 2, `${w} x ${h}: green ${g} in row ${y}`);
      assert.deepEqual([b, a], [77, 255]);
    }
  }
});

test("each corner of the print becomes that corner of the picture under a perspective", () => {
  const photograph = new ImageData(1000, 750);
  photograph.data.fill(255);
  const corners = seen(210, 297, [0.7, 0.2], 500);
  const colors = [[250, 0, 0], [0, 250, 0], [0, 0, 250], [200, 200, 0]];
  corners.forEach(([x, y], i) => {
    for (let dy = -12; dy <= 12; dy++)
      for (let dx = -12; dx <= 12; dx++)
        photograph.data.set(colors[i], 4 * ((Math.round(y) + dy) * 1000 + Math.round(x) + dx));
  });
  const flat = rectifyPicture(photograph, corners, 210, 297);
  [[1, 1], [208, 1], [208, 295], [1, 295]].forEach(([x, y], i) =>
    assert.deepEqual([...flat.data.subarray(4 * (y * 210 + x), 4 * (y * 210 + x) + 3)], colors[i]),
  );
});

test("shrinking averages: fine stripes become grey, not a moiré", () => {
  const photograph = new ImageData(400, 400);
  for (let i = 0; i < 160_000; i++) photograph.data.set(i % 2 ? [255, 255, 255, 255] : [0, 0, 0, 255], 4 * i);
  const flat = rectifyPicture(photograph, [[0, 0], [400, 0], [400, 400], [0, 400]], 100, 100);
  const reds = Array.from({ length: 100 }, (_, x) => flat.data[4 * (50 * 100 + x)]);
  assert.ok(Math.min(...reds) > 110 && Math.max(...reds) < 145, `${Math.min(...reds)} to ${Math.max(...reds)}`);
});

test("crossed, mirrored and flat outlines are none", () => {
  const square = [[0, 0], [9, 0], [9, 9], [0, 9]];
  assert.ok(isPrintOutline(square));
  for (const wrong of [
    [[0, 0], [9, 9], [9, 0], [0, 9]],
    [...square].reverse(),
    [[0, 0], [5, 0], [9, 0], [3, 0]],
    [[0, 0], [9, 0], [2, 2], [0, 9]],
  ]) {
    assert.ok(!isPrintOutline(wrong));
    assert.throws(() => rectifyPicture(new ImageData(10, 10), wrong, 4, 4), { code: "invalid-argument" });
  }
});
