import assert from "node:assert/strict";
import { test } from "node:test";

import { DeepSftError, canonicalFromImage, canonicalSize, estimatedCamera, imageFromCanonical, visibleRegion } from "deepsft";
import { cameraForImage, intrinsicsOf } from "../../src/camera/intrinsics.js";

const near = (actual, expected, tolerance = 1e-9) =>
  actual.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) <= tolerance, `${actual} is not ${expected}`));

test("the optical axis is the middle of the canonical image, whatever the camera", () => {
  const camera = { width: 1280, height: 720, fx: 900, fy: 910, cx: 650, cy: 340 };
  near(imageFromCanonical(camera, 240, 135), [650, 340]);
  near(canonicalFromImage(camera, 650, 340), [240, 135]);
});

test("a canonical pixel is fx / 380 image pixels wide", () => {
  const camera = { width: 1280, height: 720, fx: 760, fy: 1140, cx: 640, cy: 360 };
  near(imageFromCanonical(camera, 241, 136), [642, 363]);
});

test("a distorted position agrees with a hand-computed OpenCV value and comes back", () => {
  // Ray (0.2, 0.1): r2 = 0.05, radial = 1 + 0.1 * 0.05 = 1.005;
  // x = 0.201 + 2 * 0.01 * 0.02 + 0.02 * (0.05 + 0.08) = 0.204, y = 0.1005 + 0.01 * (0.05 + 0.02) + 2 * 0.02 * 0.02 = 0.102
  const camera = { width: 100, height: 100, fx: 100, fy: 100, cx: 50, cy: 50, distortion: [0.1, 0, 0.01, 0.02, 0] };
  near(imageFromCanonical(camera, 240 + 0.2 * 380, 135 + 0.1 * 380), [70.4, 60.2]);
  near(canonicalFromImage(camera, 70.4, 60.2), [316, 173]);
});

test("a fisheye's position agrees with OpenCV's and comes back", () => {
  // cv2.fisheye.projectPoints of the rays (0.3, -0.2) and (-0.5, 0.4).
  const fisheye = [0.043, -0.017, 0.0062, -0.0011];
  const camera = { width: 640, height: 480, fx: 612.5, fy: 608.75, cx: 321.25, cy: 242.5, fisheye };
  for (const [ray, pixel] of [
    [[0.3, -0.2], [498.473113015, 125.074617635]],
    [[-0.5, 0.4], [45.485196275, 461.761158227]],
    [[0, 0], [321.25, 242.5]],
  ]) {
    const canonical = [240 + ray[0] * 380, 135 + ray[1] * 380];
    near(imageFromCanonical(camera, ...canonical), pixel, 1e-6);
    near(canonicalFromImage(camera, ...pixel), canonical, 1e-6);
  }
  assert.deepEqual(intrinsicsOf(cameraForImage(camera, 320, 240)), [306.25, 304.375, 160.625, 121.25, ...fisheye]);
  const refused = (change, message) => assert.throws(() => cameraForImage({ ...camera, ...change }, 640, 480), { code: "camera-intrinsics", message });
  refused({ fisheye: [0, 0, 0] }, /four numbers/);
  refused({ distortion: [0.1, 0, 0, 0, 0] }, /a lens has one/);
});

test("of a phone's upright image the network sees nearly all, by a canonical image that is upright too", () => {
  // f = 0.79 * 1280 = 1011.2, so the canonical image is 480 / 380 * 1011.2 = 1277.3 high and 270 / 380 * 1011.2 = 718.5 wide.
  const camera = estimatedCamera(720, 1280);
  const { left, right, top, bottom } = visibleRegion(camera);
  near([left, right], [360 - 718.48421 / 2, 360 + 718.48421 / 2], 1e-4);
  near([top, bottom], [640 - 1277.30526 / 2, 640 + 1277.30526 / 2], 1e-4);
  assert.deepEqual(canonicalSize(camera), { width: 270, height: 480 });
  assert.deepEqual(canonicalSize({ width: 500, height: 500 }), { width: 480, height: 270 });
  near(canonicalFromImage(camera, 360, 640), [135, 240]);
  near(imageFromCanonical(camera, 0, 0), [left, top]);
});

test("the network sees as much as the image of a camera reaches beyond the training camera's, and no further than 119 degrees", () => {
  assert.deepEqual(visibleRegion(estimatedCamera(640, 480)), { left: 0, top: 0, right: 640, bottom: 480 });
  // The left side is nearer to the middle: there the image ends first.
  const kinect = visibleRegion({ width: 1920, height: 1080, fx: 1057.8, fy: 1064, cx: 947.6, cy: 530.4 });
  near([kinect.left, kinect.right], [0, 1920], 1e-6);
  // 240 pixels of the canonical image at 0.375 * 380 are a ray of 1.684, 59.3 degrees from the axis: 250 pixels a radian.
  const fisheye = visibleRegion({ width: 800, height: 600, fx: 250, fy: 250, cx: 400, cy: 300, fisheye: [0, 0, 0, 0] });
  near([fisheye.left, fisheye.right], [400 - 250 * Math.atan(240 / 142.5), 400 + 250 * Math.atan(240 / 142.5)], 1e-6);
});

test("a camera for the same picture at half the size is scaled, for it turned by a quarter turned, one for another shape refused", () => {
  const camera = { width: 1280, height: 720, fx: 1000, fy: 1010, cx: 630, cy: 350 };
  const { fx, fy, cx, cy, source } = cameraForImage(camera, 640, 360);
  assert.deepEqual([fx, fy, cx, cy, source], [500, 505, 315, 175, "given"]);
  const across = { ...camera, distortion: [0.1, -0.05, 0.02, -0.01] };
  const upright = cameraForImage(across, 360, 640);
  assert.deepEqual([upright.fx, upright.fy, upright.cx, upright.cy], [505, 500, 185, 315]);
  // What the camera across sees at (x, y) the one upright sees at (height - y, x).
  const [x, y] = imageFromCanonical(cameraForImage(across, 640, 360), 300, 170);
  near(imageFromCanonical(upright, 135 - 35, 240 + 60), [360 - y, x], 1e-6);
  assert.throws(() => cameraForImage(camera, 720, 720), {
    name: "DeepSftError",
    code: "camera-intrinsics",
    message: /1280 x 720.*720 x 720/,
  });
});

test("a focal length of zero, NaN or text is refused by name", () => {
  for (const fx of [0, -3, Number.NaN, Number.POSITIVE_INFINITY, "1000", undefined]) {
    const camera = { width: 640, height: 480, fx, fy: 500, cx: 320, cy: 240 };
    assert.throws(
      () => cameraForImage(camera, 640, 480),
      (error) => error instanceof DeepSftError && error.code === "camera-intrinsics" && /fx/.test(error.message),
    );
  }
});
