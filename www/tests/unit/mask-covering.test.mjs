import assert from "node:assert/strict";
import { test } from "node:test";

import { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH } from "deepsft";
import { MaskCovering, confirmed, seenFractions } from "deepsft/light";

/** A point that the canonical camera sees at a pixel, 380 mm away: a millimetre a pixel. */
const at = (column, row) => [column - CANONICAL_WIDTH / 2 + 0.5, row - CANONICAL_HEIGHT / 2 + 0.5, 380];

/** An estimate that sees everything left of column 240. */
function leftHalf(focal = CANONICAL_FOCAL) {
  const mask = new Uint8Array(CANONICAL_WIDTH * CANONICAL_HEIGHT);
  for (let row = 0; row < CANONICAL_HEIGHT; row++)
    mask.fill(1, row * CANONICAL_WIDTH, row * CANONICAL_WIDTH + 240);
  return { mask: { values: () => mask, width: CANONICAL_WIDTH, height: CANONICAL_HEIGHT }, focal };
}

/** A mesh of one vertex that the image says nothing about. */
const mesh = (vertex, uv = [0.5, 0.5]) => ({
  vertices: Float32Array.from(vertex),
  textureCoordinates: Float32Array.from(uv),
  confidence: Float32Array.of(0),
});

test("a vertex is seen a pixel beyond the mask, four on the sheet's border, and where the image does not reach", () => {
  const seen = (column, row, uv) => seenFractions(mesh(at(column, row), uv), leftHalf())[0];
  assert.deepEqual(
    [100, 240, 241].map((column) => seen(column, 100)),
    [1, 1, 0],
  );
  assert.deepEqual(
    [243, 244].map((column) => seen(column, 100, [1, 0.3])),
    [1, 0],
  );
  assert.deepEqual([seen(600, 100), seen(300, -5)], [1, 1]);
  // Zoomed out to a half, what was 1.5 pixels to the right of the middle is 0.75.
  const zoomed = (column) => seenFractions(mesh(at(column, 100)), leftHalf(CANONICAL_FOCAL / 2))[0];
  assert.deepEqual([zoomed(239), zoomed(241), zoomed(242)], [1, 1, 0]);
});

test("what the image itself confirms is seen, whatever the mask says", () => {
  const seen = confirmed(Float32Array.of(0, 0, 0, 1), Float32Array.of(0.2, 0.725, 0.9, 0));
  for (const [i, expected] of [0, 0.5, 1, 1].entries()) assert.ok(Math.abs(seen[i] - expected) < 1e-6, `${seen}`);
});

test("the mask of an older frame is looked up at the mesh of that frame", () => {
  const covering = new MaskCovering();
  assert.deepEqual([...covering.follow(1, mesh(at(300, 100)), true)], [1], "nothing covers it before the first answer");
  covering.follow(2, mesh(at(100, 100)), true);
  covering.answer(1, leftHalf());
  const [fraction] = covering.follow(3, mesh(at(100, 100)), true);
  assert.ok(Math.abs(fraction - 0.4) < 1e-6, `${fraction}: hidden in frame 1, with a weight of 0.6`);
  covering.answer(2, leftHalf());
  const [again] = covering.follow(4, mesh(at(100, 100)), true);
  assert.ok(Math.abs(again - 0.76) < 1e-6, `${again}`);
});

test("an answer to a frame that was not followed, or not well, changes nothing", () => {
  const covering = new MaskCovering();
  covering.follow(1, mesh(at(300, 100)), false);
  covering.answer(1, leftHalf());
  covering.answer(7, leftHalf());
  assert.deepEqual([...covering.follow(2, mesh(at(300, 100)), true)], [1]);
});
