// Drawing at the screen's rate, on machines that can.

/** A machine that takes longer from frame to frame draws with its processor, which has better things to do. */
const SLOW_DRAW_MS = 45;
/** It is judged by the median of this many draws, or of three when they take longer than a second together. */
const JUDGED_DRAWS = 12;

/**
 * Calls `draw` for each frame of the screen until stopped, or until the machine turns out too slow.
 *
 * @param {(seconds: number) => boolean} draw given a clock; false when there was nothing to draw
 * @param {(slowness: number) => void} onSlow called when it is given up: how many times too slow
 * @returns {() => void} stops
 */
export function animate(draw, onSlow) {
  let request = 0;
  let last = Number.NaN;
  /** @type {number[]} */
  let intervals = [];
  const tick = (/** @type {number} */ now) => {
    if (
      intervals.length === JUDGED_DRAWS ||
      (intervals.length >= 3 && intervals.reduce((sum, ms) => sum + ms, 0) > 1000)
    ) {
      const median = intervals.sort((a, b) => a - b)[intervals.length >> 1];
      if (median > SLOW_DRAW_MS) return onSlow(median / SLOW_DRAW_MS);
      intervals = [];
    }
    const drawn = draw(now / 1000);
    if (drawn && Number.isFinite(last)) intervals.push(now - last);
    last = drawn ? now : Number.NaN;
    request = requestAnimationFrame(tick);
  };
  request = requestAnimationFrame(tick);
  return () => cancelAnimationFrame(request);
}

/** Whether the person asked their system for less motion. */
export function prefersStillness() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
