// From nothing to all, as something grows.

/** @typedef {{ from: number, fully: number }} Range where it begins to count, and where it counts fully */

/**
 * @param {number} value
 * @param {Range} range
 * @returns {number} 0 to 1
 */
export function ramp(value, { from, fully }) {
  return Math.min(1, Math.max(0, (value - from) / (fully - from)));
}

/** As `ramp`, gently at both ends. @param {number} value @param {Range} range */
export function gentleRamp(value, range) {
  const x = ramp(value, range);
  return x * x * (3 - 2 * x);
}
