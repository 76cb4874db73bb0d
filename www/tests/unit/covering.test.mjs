import assert from "node:assert/strict";
import { test } from "node:test";

import { CANONICAL_HEIGHT, CANONICAL_WIDTH } from "deepsft";
import { Covering, seenShares } from "../../demo/covering.js";

/** A point that the canonical camera sees at a pixel, 380 mm away: a millimetre a pixel. */
const at = (column, row) => [column - CANONICAL_WIDTH / 2 + 0.5, row - CANONICAL_HEIGHT / 2 + 0.5, 380];

/** A mask that sees everything left of column 240. */
function leftHalf() {
  const mask = new Uint8Array(CANONICAL_WIDTH * CANONICAL_HEIGHT);
  for (let row = 0; row < CANONICAL_HEIGHT; row++)
    mask.fill(1, row * CANONICAL_WIDTH, row * CANONICAL_WIDTH + 240);
  return mask;
}

test("a vertex is seen up to two pixels beyond the mask, and where the image does not reach", () => {
  const vertices = Float32Array.from([at(100, 100), at(241, 100), at(243, 100), at(600, 100), at(300, -5)].flat());
  assert.deepEqual([...seenShares(vertices, leftHalf())], [1, 1, 0, 1, 1]);
});

test("the mask of an older frame is looked up at the mesh of that frame", () => {
  const covering = new Covering();
  const before = Float32Array.from(at(300, 100));
  assert.deepEqual([...covering.follow(1, before)], [1], "nothing covers it before the first answer");
  covering.follow(2, Float32Array.from(at(100, 100)));
  covering.answer(1, leftHalf());
  const [share] = covering.follow(3, Float32Array.from(at(100, 100)));
  assert.ok(Math.abs(share - 0.4) < 1e-6, `${share}: hidden in frame 1, with a weight of 0.6`);
  covering.answer(2, leftHalf());
  const [again] = covering.follow(4, Float32Array.from(at(100, 100)));
  assert.ok(Math.abs(again - 0.76) < 1e-6, `${again}`);
});

test("an answer to a frame that was not followed changes nothing", () => {
  const covering = new Covering();
  covering.follow(1, Float32Array.from(at(300, 100)));
  covering.answer(7, leftHalf());
  assert.deepEqual([...covering.follow(2, Float32Array.from(at(300, 100)))], [1]);
});
