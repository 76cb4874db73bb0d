// What several tests need.

/** Deterministic noise in -1..1, of mean 0 (a linear congruential generator). */
export function noise(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0;
    return state / 2 ** 31 - 1;
  };
}
