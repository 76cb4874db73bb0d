import assert from "node:assert/strict";
import { test } from "node:test";

import { applyHomography, fitHomography } from "../../src/calibration/homography.js";
import { noise } from "./support.mjs";

const TRUTH = [1.2, 0.1, 30, -0.2, 0.9, -10, 4e-4, -7e-4, 1];
const GRID = Array.from({ length: 100 }, (_, i) => [(i % 10) * 30 - 135, Math.floor(i / 10) * 20 - 90]);

test("exact points give the homography they came from", () => {
  const { matrix, rms } = fitHomography(
    GRID,
    GRID.map((p) => applyHomography(TRUTH, p)),
  );
  // Up to its scale.
  matrix.forEach((h, i) => assert.ok(Math.abs(h / matrix[8] - TRUTH[i]) < 1e-9, `entry ${i}: ${h}`));
  assert.ok(rms < 1e-9);
});

test("a tenth of the points far off is left out", () => {
  const random = noise(3);
  const image = GRID.map((p, i) => applyHomography(TRUTH, p).map((x) => x + 0.3 * random() + (i % 10 === 4 ? 25 : 0)));
  const { matrix, rms } = fitHomography(GRID, image);
  const [x, y] = applyHomography(matrix, [0, 0]);
  // Noise of 0.3 / sqrt(3) a point, averaged over 90.
  assert.ok(Math.hypot(x - 30, y + 10) < 0.2, `${x}, ${y}`);
  assert.ok(rms < 0.4, `${rms}`);
});

test("points on a line determine no homography", () => {
  const line = GRID.map(([x]) => [x, 2 * x]);
  assert.equal(fitHomography(line, line), null);
});
