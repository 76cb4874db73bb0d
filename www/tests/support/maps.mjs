// Maps against each other and against the truth.

/** A4, landscape, mm: the poster. */
const SHEET_MM = [297, 210];

/**
 * Errors as `deepsft eval` defines them, over the pixels inside both masks.
 *
 * @param {{ depth: Float32Array, registration: Float32Array }} answer
 * @param {{ depth: Float32Array, registration: Float32Array }} truth
 */
export function errorsOf(answer, truth) {
  let [both, either, depth, registration] = [0, 0, 0, 0];
  for (let i = 0; i < truth.depth.length; i++) {
    const [a, t] = [answer.depth[i] > -1, truth.depth[i] > -1];
    if (a || t) either++;
    if (!a || !t) continue;
    both++;
    depth += (answer.depth[i] - truth.depth[i]) ** 2;
    for (let k = 0; k < 2; k++)
      registration += ((answer.registration[2 * i + k] - truth.registration[2 * i + k]) * SHEET_MM[k]) ** 2;
  }
  return {
    depth_rmse_mm: Math.sqrt(depth / both),
    registration_rmse_mm: Math.sqrt(registration / both),
    mask_iou: both / either,
  };
}

/**
 * How far two answers to the same picture are apart: pixels that only one calls object, and the 99th percentile of
 * depth and registration where both do.
 */
export function disagreement(one, other) {
  const [depths, registrations] = [[], []];
  let apart = 0;
  for (let i = 0; i < one.depth.length; i++) {
    const [a, b] = [one.depth[i] > -1, other.depth[i] > -1];
    if (a !== b) apart++;
    if (!a || !b) continue;
    depths.push(Math.abs(one.depth[i] - other.depth[i]));
    const offset = [0, 1].map((k) => (one.registration[2 * i + k] - other.registration[2 * i + k]) * SHEET_MM[k]);
    registrations.push(Math.hypot(...offset));
  }
  const percentile = (values) => values.sort((x, y) => x - y)[Math.floor(0.99 * (values.length - 1))] ?? 0;
  return { maskPixels: apart, depthMm: percentile(depths), registrationMm: percentile(registrations) };
}

/** The middle one of some numbers. */
export function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return (sorted[(sorted.length - 1) >> 1] + sorted[sorted.length >> 1]) / 2;
}
