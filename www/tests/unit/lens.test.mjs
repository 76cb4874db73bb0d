// The two lens models against OpenCV, and there and back over whole images. The same cameras as in the tests of the Rust side.

import assert from "node:assert/strict";
import { test } from "node:test";

import { distorted, lensUniform, undistorted } from "../../src/camera/lens.js";

const PINHOLE = { width: 640, height: 480, fx: 612.5, fy: 608.75, cx: 321.25, cy: 242.5 };
const ORDINARY = { ...PINHOLE, distortion: [-0.21, 0.062, 0.0011, -0.0017, -0.004] };
const FISHEYE = { ...PINHOLE, fisheye: [0.043, -0.017, 0.0062, -0.0011] };
/** A fisheye of 170 degrees from corner to corner, and an ordinary wide lens whose polynomial just serves the corners. */
const WIDE = [
  { width: 1280, height: 960, fx: 520, fy: 521, cx: 636, cy: 482, fisheye: [0.02, -0.01, 0.004, -0.0012] },
  { width: 1280, height: 960, fx: 700, fy: 702, cx: 645, cy: 476, distortion: [-0.3, 0.11, 0.0008, -0.0006, -0.01] },
];

const pixelOf = (camera, [x, y]) => {
  const place = distorted(camera, x, y);
  return [place[0] * camera.fx + camera.cx, place[1] * camera.fy + camera.cy];
};
const rayOf = (camera, [x, y]) => undistorted(camera, (x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

test("rays go where OpenCV says", () => {
  // cv2.projectPoints and cv2.fisheye.projectPoints of opencv-python 5.0.0, the rays (x, y, 1) as points, no pose.
  for (const [camera, pairs] of [
    [ORDINARY, [
      [[0, 0], [321.25, 242.5]],
      [[0.3, -0.2], [499.770905955, 124.212081539]],
      [[-0.5, 0.4], [37.043716975, 468.408102896]],
      [[0.7, 0.35], [703.102490947, 432.984385058]],
      [[-0.05, -0.6], [292.370421392, -97.188733029]],
      [[1.2, -0.7], [900.82205292, -93.386517868]],
    ]],
    [FISHEYE, [
      [[0, 0], [321.25, 242.5]],
      [[0.3, -0.2], [498.473113015, 125.074617635]],
      [[-0.5, 0.4], [45.485196275, 461.761158227]],
      [[0.7, 0.35], [690.917782584, 426.202255223]],
      [[-0.05, -0.6], [293.37183165, -89.989828243]],
      [[1.2, -0.7], [836.569034712, -56.262345125]],
    ]],
    [WIDE[0], [
      [[0.2, 0.1], [738.413560229, 533.305254692]],
      [[-0.8, 0.5], [299.580266261, 692.666684228]],
      [[2, -1.4], [1146.976625914, 123.62850871]],
      [[-6, 4], [8.424918537, 901.18797108]],
    ]],
    [WIDE[1], [
      [[0.2, 0.1], [782.906125, 545.18868125]],
      [[-0.8, 0.5], [188.3150664, 762.50912381]],
      [[1, -0.7], [1177.642257, 102.482607986]],
    ]],
  ]) {
    for (const [ray, pixel] of pairs) assert.ok(apart(pixelOf(camera, ray), pixel) < 1e-6, `${ray}: ${pixelOf(camera, ray)}`);
  }
});

test("pixels come from where OpenCV says", () => {
  // cv2.undistortPoints and cv2.fisheye.undistortPoints of opencv-python 5.0.0, with 200 iterations.
  const pixels = [[20, 15], [620, 30], [321.25, 242.5], [10, 470], [400, 100]];
  for (const [camera, rays] of [
    [ORDINARY, [[-0.534761643, -0.407509981], [0.531777061, -0.380527256], [0, 0], [-0.553222226, 0.406931435], [0.130805593, -0.238004355]]],
    [FISHEYE, [[-0.55558913, -0.422158176], [0.546800486, -0.391333504], [0, 0], [-0.577344668, 0.424594456], [0.131309563, -0.239071484]]],
  ]) {
    for (const [i, pixel] of pixels.entries()) assert.ok(apart(rayOf(camera, pixel), rays[i]) < 1e-6, `${pixel}: ${rayOf(camera, pixel)}`);
  }
});

test("every pixel comes back to itself up to the corners of wide lenses", () => {
  for (const camera of [ORDINARY, FISHEYE, ...WIDE]) {
    let most = 0;
    for (let y = 0; y <= camera.height; y += 8)
      for (let x = 0; x <= camera.width; x += 8) most = Math.max(most, apart(pixelOf(camera, rayOf(camera, [x, y])), [x, y]));
    assert.ok(most < 1e-8, `${JSON.stringify(camera)}: ${most} px`);
  }
});

test("beyond the fold of a model no pixel is met twice", () => {
  // r (1 - 0.3 r^2) is largest at r = sqrt(1 / 0.9), where it is 2 / 3 of that.
  const [lens, fold] = [{ distortion: [-0.3, 0, 0, 0, 0] }, Math.sqrt(1 / 0.9)];
  const rim = (2 / 3) * fold;
  assert.ok(apart(distorted(lens, fold, 0), [rim, 0]) < 1e-12);
  // The model itself would bring this ray to the middle, and farther ones to the other side.
  assert.ok(apart(distorted(lens, Math.sqrt(1 / 0.3), 0), [rim + Math.sqrt(1 / 0.3) - fold, 0]) < 1e-12);
  assert.ok(apart(undistorted(lens, 0, -2), [0, -fold]) < 1e-9, "the outermost ray in the same direction");
  assert.ok(Math.abs(lensUniform(lens)[6] - fold) < 1e-12);
});

test("a lens without coefficients is none unless it is a fisheye", () => {
  for (const none of [{}, { distortion: [0, 0, 0, 0, 0] }]) {
    assert.deepEqual([distorted(none, 3, -2), undistorted(none, 3, -2)], [[3, -2], [3, -2]]);
    assert.deepEqual(lensUniform(none), [0, 0, 0, 0, 0, -1, 1e6]);
  }
  const equidistant = { fisheye: [0, 0, 0, 0] };
  assert.ok(apart(distorted(equidistant, 1, 0), [Math.PI / 4, 0]) < 1e-12);
  assert.deepEqual(lensUniform(equidistant), [0, 0, 0, 0, 0, 1, 1e6]);
});
