import assert from "node:assert/strict";
import { test } from "node:test";

import { PrintCovering } from "deepsft/light";

const [COLUMNS, ROWS] = [12, 9];

/** A print whose left half has detail and whose right half is blank, on a grid. */
function target() {
  const [width, height] = [120, 90];
  const data = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width / 2; x++) data.fill((x ^ y) & 4 ? 30 : 220, 4 * (y * width + x), 4 * (y * width + x) + 3);
  const [uv, faces] = [[], []];
  for (let j = 0; j < ROWS; j++) for (let i = 0; i < COLUMNS; i++) uv.push(i / (COLUMNS - 1), j / (ROWS - 1));
  for (let j = 0; j + 1 < ROWS; j++) {
    for (let i = 0; i + 1 < COLUMNS; i++) {
      const a = j * COLUMNS + i;
      faces.push(a, a + COLUMNS, a + 1, a + 1, a + COLUMNS, a + COLUMNS + 1);
    }
  }
  const mesh = { faces: Uint32Array.from(faces), textureCoordinates: Float32Array.from(uv) };
  return { texture: { data, width, height }, mesh };
}

/** Confidence of the print where a hand covers the columns from..to. */
function confidence(from, to) {
  return Float32Array.from({ length: COLUMNS * ROWS }, (_, k) => {
    const i = k % COLUMNS;
    return i >= COLUMNS / 2 || (i >= from && i < to) ? 0 : 0.9;
  });
}

test("detail that the image does not show is covered; blank paper is not for that alone", () => {
  const covering = new PrintCovering(target());
  const at = (seen, column) => seen[4 * COLUMNS + column];
  const free = covering.follow({ confidence: confidence(0, 0) }, true);
  for (const column of [0, 3, 8, 11]) assert.ok(at(free, column) > 0.9, `column ${column}: ${at(free, column)}`);
  let held;
  for (let frame = 0; frame < 8; frame++) held = covering.follow({ confidence: confidence(0, 3) }, true);
  assert.ok(at(held, 0) < 0.1 && at(held, 1) < 0.1, `${at(held, 0)}, ${at(held, 1)}`);
  for (const column of [4, 8, 11]) assert.ok(at(held, column) > 0.75, `column ${column}: ${at(held, column)}`);
});

test("a mesh that lies badly does not make the print vanish, and one that goes on so brings it back", () => {
  const covering = new PrintCovering(target());
  const before = covering.follow({ confidence: confidence(0, 0) }, true);
  covering.follow({ confidence: confidence(0, COLUMNS) }, false).forEach((seen, i) => assert.ok(seen >= before[i]));
  let seen;
  for (let frame = 0; frame < 8; frame++) seen = covering.follow({ confidence: confidence(0, 3) }, true);
  assert.ok(seen[4 * COLUMNS] < 0.1);
  for (let frame = 0; frame < 90; frame++) seen = covering.follow({ confidence: confidence(0, 3) }, false);
  assert.ok(seen[4 * COLUMNS] > 0.9, `${seen[4 * COLUMNS]}`);
});

test("a hand that is there from the first frame is seen at once", () => {
  const seen = new PrintCovering(target()).follow({ confidence: confidence(0, 3) }, true);
  assert.ok(seen[4 * COLUMNS] < 0.1);
});
