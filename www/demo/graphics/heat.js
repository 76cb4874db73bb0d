// The colours of the depth map, near to far, shared by the picture and its colour bar.

/** sRGB stops at equal steps: lightness falls evenly, so the map reads in grey as well. */
const STOPS = [
  [255, 246, 214],
  [252, 205, 134],
  [240, 142, 98],
  [206, 84, 105],
  [142, 56, 121],
  [76, 45, 112],
  [27, 28, 70],
];

/**
 * The scale as a picture of one row.
 *
 * @param {number} width pixels
 * @returns {Uint8Array} RGBA
 */
export function heatRow(width) {
  const row = new Uint8Array(4 * width).fill(255);
  for (let i = 0; i < width; i++) {
    const x = (i / (width - 1)) * (STOPS.length - 1);
    const stop = Math.min(STOPS.length - 2, Math.floor(x));
    for (let k = 0; k < 3; k++)
      row[4 * i + k] = Math.round(STOPS[stop][k] + (STOPS[stop + 1][k] - STOPS[stop][k]) * (x - stop));
  }
  return row;
}

/**
 * The scale as a CSS gradient, near first.
 *
 * @param {string} direction such as "to top"
 */
export function heatGradient(direction) {
  return `linear-gradient(${direction}, ${STOPS.map((stop) => `rgb(${stop.join(" ")})`).join(", ")})`;
}

/** Narrowest scale, mm: a frontal sheet should not show noise in all the colours. */
const MIN_SPAN_MM = 40;

/**
 * The depths a scale should cover: the middle 96 % of those seen.
 *
 * @param {Float32Array} depth mm, -1 outside
 * @returns {{ near: number, far: number } | null} null when nothing is seen
 */
export function depthRange(depth) {
  const seen = depth.filter((d, i) => i % 7 === 0 && d > 0).sort();
  if (seen.length === 0) return null;
  const at = (/** @type {number} */ fraction) => seen[Math.round(fraction * (seen.length - 1))];
  const [near, far] = [at(0.02), at(0.98)];
  const widen = Math.max(0, MIN_SPAN_MM - (far - near)) / 2;
  return { near: near - widen, far: far + widen };
}

/**
 * Round values to label a scale with, from near to far.
 *
 * @param {{ near: number, far: number }} range
 * @param {number} most labels
 */
export function depthTicks({ near, far }, most) {
  const step = [5, 10, 20, 50, 100, 200, 500, 1000].find((s) => (far - near) / s <= most - 1) ?? 2000;
  const ticks = [];
  for (let tick = Math.ceil(near / step) * step; tick <= far; tick += step) ticks.push(tick);
  return { step, ticks };
}
