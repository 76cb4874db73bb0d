import assert from "node:assert/strict";
import { test } from "node:test";

import { depthRange, depthTicks, heatRow } from "../../demo/graphics/heat.js";
import { TemplateLight, VertexLight } from "deepsft/light";

const byteOf = (linear) =>
  Math.round(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055));

test("the depth scale covers the sheet with round labels", () => {
  const depth = Float32Array.from({ length: 7000 }, (_, i) => (i % 2 === 0 ? 400 + (i / 7000) * 200 : -1));
  const { near, far } = depthRange(depth);
  assert.ok(Math.abs(near - 404) < 2 && Math.abs(far - 596) < 2, `${near} to ${far}`);
  assert.deepEqual(depthTicks({ near: 404, far: 596 }, 6), { step: 50, ticks: [450, 500, 550] });
  assert.equal(depthRange(new Float32Array(100).fill(-1)), null);
  const frontal = depthRange(new Float32Array(100).fill(500));
  assert.deepEqual(frontal, { near: 480, far: 520 }, "at least 40 mm, so that noise is not in all the colours");
});

test("the heat colours darken from near to far", () => {
  const row = heatRow(64);
  const grey = Array.from(
    { length: 64 },
    (_, i) => 0.2126 * row[4 * i] + 0.7152 * row[4 * i + 1] + 0.0722 * row[4 * i + 2],
  );
  for (let i = 1; i < 64; i++) assert.ok(grey[i] < grey[i - 1], `at ${i}`);
});

/** A flat sheet of 11 x 6 vertices that fills columns 32 to 128 of an image of 160 x 90 pixels, half dark print, half bright, in `light`. */
function litSheet(light, turned = false) {
  const [columns, rows] = [11, 6];
  const camera = { width: 160, height: 90, fx: 100, fy: 100, cx: 80, cy: 45, distortion: [0, 0, 0, 0, 0] };
  const print = (u) => (u < 0.5 ? 0.8 : 0.2);
  const vertices = [];
  const textureCoordinates = [];
  const faces = [];
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < columns; i++) {
      const [u, v] = [i / (columns - 1), j / (rows - 1)];
      vertices.push(32 + 96 * u - 80, 90 * v - 45, 100);
      textureCoordinates.push(u, v);
      // Counter-clockwise as the image, whose y points down, shows it.
      const [a, b, c, d] = [0, 1, columns, columns + 1].map((step) => j * columns + i + step);
      if (i + 1 < columns && j + 1 < rows) faces.push(...(turned ? [a, b, c, b, d, c] : [a, c, b, b, c, d]));
    }
  }
  const grey = (width, height, valueAt) => {
    const data = new Uint8ClampedArray(4 * width * height).fill(255);
    for (let i = 0; i < width * height; i++) data.fill(byteOf(valueAt(((i % width) + 0.5) / width)), 4 * i, 4 * i + 3);
    return { data, width, height };
  };
  const mesh = { faces: Uint32Array.from(faces), textureCoordinates: Float32Array.from(textureCoordinates) };
  const frame = grey(160, 90, (x) => light * print((160 * x - 32) / 96));
  const vertexLight = new VertexLight(mesh, new TemplateLight(grey(64, 32, print)));
  return vertexLight.of(Float32Array.from(vertices), new Float32Array(columns * rows).fill(1), camera, frame);
}

test("the vertices of a sheet in half the light have about one half, on bright and dark print alike", () => {
  // The floor of 0.02 under both sides: (0.4 + 0.02) / (0.8 + 0.02) = 0.512 on bright print, 0.12 / 0.22 = 0.545 on dark.
  const [bright, dark] = [0.512, 0.545];
  const light = litSheet(0.5);
  assert.equal(light.length, 66);
  for (const [row, value] of [0, 2, 5].flatMap((row) => [[row, bright], [row, dark]])) {
    const column = value === bright ? 1 : 9;
    assert.ok(Math.abs(light[11 * row + column] - value) < 0.01, `${light[11 * row + column]} is not ${value}`);
  }
  // Where both prints are near each other the light stays between.
  assert.ok(light.every((l) => l > bright - 0.02 && l < dark + 0.02), `${light}`);
});

test("the back of a sheet tells nothing of the light", () => {
  assert.ok(litSheet(0.5, true).every((light) => light === 1));
});
