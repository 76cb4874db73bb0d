// The mask's outline as people draw it, not as pixels do.

/**
 * The mask without its staircase: each pixel the binomial mean (1, 4, 6, 4, 1) / 16 of its neighbours, both ways.
 *
 * @param {Uint8Array} mask 0 or 1, row-major
 * @param {number} w columns
 * @returns {Uint8Array} 0 to 255
 */
export function softMask(mask, w) {
  const h = mask.length / w;
  const rows = new Uint8Array(mask.length);
  const soft = new Uint8Array(mask.length);
  // Beyond an end its pixel repeats.
  for (let start = 0; start < mask.length; start += w) {
    const last = start + w - 1;
    let [a, b, c, d] = [mask[start], mask[start], mask[start], mask[start + 1]];
    for (let i = start; i <= last; i++) {
      const e = mask[Math.min(i + 2, last)];
      rows[i] = a + e + 4 * (b + d) + 6 * c;
      a = b;
      b = c;
      c = d;
      d = e;
    }
  }
  for (let y = 0; y < h; y++) {
    const c = w * y;
    const [b, d] = [Math.max(0, c - w), Math.min(c + w, w * (h - 1))];
    const [a, e] = [Math.max(0, b - w), Math.min(d + w, w * (h - 1))];
    for (let x = 0; x < w; x++) {
      const sum = rows[a + x] + rows[e + x] + 4 * (rows[b + x] + rows[d + x]) + 6 * rows[c + x];
      // 256 times the mean: 256 inside, which a byte does not hold.
      soft[c + x] = sum - (sum >> 8);
    }
  }
  return soft;
}
