import assert from "node:assert/strict";
import { test } from "node:test";

import { FocalCalibration } from "../../src/calibration/focal-calibration.js";
import { SHEET, flatSheet, noise } from "./support.mjs";

const degrees = (angle) => (angle * Math.PI) / 180;
const EIGHT_TILTS = Array.from({ length: 8 }, (_, i) => ({ angle: degrees(30 + 3 * i), azimuth: degrees(45 * i) }));

test("eight exact tilts of the sheet give the true focal length although another one was assumed", () => {
  const calibration = new FocalCalibration(SHEET);
  for (const tilt of EIGHT_TILTS) {
    assert.equal(calibration.result(), null, "no result before the last view");
    assert.equal(calibration.add(flatSheet({ trueFocal: 1200, assumedFocal: 1011, ...tilt })), "taken");
  }
  const { focal, spread } = calibration.result();
  // Exact but for 32-bit registration.
  assert.ok(Math.abs(focal - 1200) < 0.5, `${focal}`);
  assert.ok(spread < 0.5, `${spread}`);
});

test("registration noise of two pixels still gives the focal length to four percent, and the spread says so", () => {
  const random = noise(9);
  const calibration = new FocalCalibration(SHEET);
  // At 520 mm a canonical pixel is 520 / 380 = 1.4 mm wide.
  for (const tilt of EIGHT_TILTS)
    calibration.add(flatSheet({ trueFocal: 1200, assumedFocal: 1011, jitterMm: 2.7, random, ...tilt }));
  const { focal, spread } = calibration.result();
  assert.ok(Math.abs(focal / 1200 - 1) < 0.04, `${focal}`);
  assert.ok(spread > 1 && spread < 60, `${spread}`);
});

test("a bent, a frontal, a repeated and a missing sheet are not taken, each with its reason", () => {
  const calibration = new FocalCalibration(SHEET);
  const view = { trueFocal: 1011, assumedFocal: 1011, angle: degrees(40), azimuth: 0 };
  assert.equal(calibration.add(flatSheet({ ...view, bendMm: 12 })), "not-flat");
  assert.equal(calibration.add(flatSheet({ ...view, angle: degrees(5) })), "not-tilted");
  assert.equal(calibration.add({ ...flatSheet(view), found: false }), "not-found");
  assert.equal(calibration.add(flatSheet(view)), "taken");
  assert.equal(calibration.add(flatSheet({ ...view, angle: degrees(43) })), "too-similar");
  assert.equal(calibration.taken, 1);
});
