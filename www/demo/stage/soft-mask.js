// The mask's outline as people draw it, not as pixels do.

import { CANONICAL_HEIGHT, CANONICAL_WIDTH } from "deepsft";

/**
 * The mask without its staircase: each pixel the binomial mean (1, 4, 6, 4, 1) / 16 of its neighbours, both ways.
 *
 * @param {Uint8Array} mask 0 or 1
 * @returns {Uint8Array} 0 to 255
 */
export function softMask(mask) {
  const rows = new Uint8Array(mask.length);
  const soft = new Uint8Array(mask.length);
  const [w, h] = [CANONICAL_WIDTH, CANONICAL_HEIGHT];
  const mean = (
    /** @type {Uint8Array} */ from,
    /** @type {number} */ i,
    /** @type {number} */ at,
    /** @type {number} */ length,
    /** @type {number} */ step,
  ) => {
    const tap = (/** @type {number} */ offset) =>
      from[i + step * (Math.min(length - 1, Math.max(0, at + offset)) - at)];
    return tap(-2) + tap(2) + 4 * (tap(-1) + tap(1)) + 6 * tap(0);
  };
  for (let y = 0, i = 0; y < h; y++) for (let x = 0; x < w; x++, i++) rows[i] = mean(mask, i, x, w, 1);
  for (let y = 0, i = 0; y < h; y++) for (let x = 0; x < w; x++, i++) soft[i] = Math.min(255, mean(rows, i, y, h, w));
  return soft;
}
