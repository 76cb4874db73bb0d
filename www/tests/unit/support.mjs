// A flat sheet seen by a known camera, as exact maps: what an ideal estimator would answer.

import { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH } from "../../src/camera/canonical.js";

/** A4, landscape, mm. */
export const SHEET = { widthMm: 297, heightMm: 210 };

/** Deterministic noise in -1..1, of mean 0 (a linear congruential generator). */
export function noise(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0;
    return state / 2 ** 31 - 1;
  };
}

/** Rotation by `angle` about the image's axis at `azimuth` (a tilt towards that side), row-major. */
function tilt(angle, azimuth) {
  const [x, y] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [c + x * x * (1 - c), x * y * (1 - c), y * s, x * y * (1 - c), c + y * y * (1 - c), -x * s, -y * s, x * s, c];
}

/**
 * Maps of the sheet at `distanceMm`, tilted, in a camera of `trueFocal` that the estimator takes for `assumedFocal`
 * (image pixels): depth is left out, registration is per canonical pixel of the assumed camera.
 */
export function flatSheet({
  trueFocal,
  assumedFocal,
  angle,
  azimuth,
  distanceMm = 520,
  jitterMm = 0,
  random = noise(1),
  bendMm = 0,
}) {
  const r = tilt(angle, azimuth);
  const registration = new Float32Array(CANONICAL_WIDTH * CANONICAL_HEIGHT * 2).fill(-1);
  const mask = new Uint8Array(CANONICAL_WIDTH * CANONICAL_HEIGHT);
  // The assumed camera magnifies the true ray by assumed / true.
  const focal = CANONICAL_FOCAL * (trueFocal / assumedFocal);
  for (let row = 0; row < CANONICAL_HEIGHT; row++) {
    for (let column = 0; column < CANONICAL_WIDTH; column++) {
      const ray = [(column + 0.5 - CANONICAL_WIDTH / 2) / focal, (row + 0.5 - CANONICAL_HEIGHT / 2) / focal, 1];
      // Ray and plane: s ray = R (X, Y, 0) + t; normal n = third column of R.
      const normal = [r[2], r[5], r[8]];
      const s = (normal[2] * distanceMm) / (normal[0] * ray[0] + normal[1] * ray[1] + normal[2]);
      const p = [s * ray[0], s * ray[1], s * ray[2] - distanceMm];
      const x = r[0] * p[0] + r[3] * p[1] + r[6] * p[2] + jitterMm * random();
      const y = r[1] * p[0] + r[4] * p[1] + r[7] * p[2] + jitterMm * random() + bendMm * Math.cos(x / 50);
      if (Math.abs(x) > SHEET.widthMm / 2 || Math.abs(y) > SHEET.heightMm / 2 || s <= 0) continue;
      const i = row * CANONICAL_WIDTH + column;
      mask[i] = 1;
      registration[2 * i] = x / SHEET.widthMm + 0.5;
      registration[2 * i + 1] = y / SHEET.heightMm + 0.5;
    }
  }
  return {
    found: true,
    camera: { fx: assumedFocal },
    focal: CANONICAL_FOCAL,
    registration: { values: () => registration },
    mask: { values: () => mask, width: CANONICAL_WIDTH, height: CANONICAL_HEIGHT },
  };
}
