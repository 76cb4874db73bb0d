// Prints that nobody has seen: discs, bars and rows of strokes, by a seed.

import { noise } from "../unit/support.mjs";

/**
 * @param {{ width: number, height: number, seed: number, shapes?: number }} options
 * @returns {{ width: number, height: number, values: Uint8Array }} RGB
 */
export function makePrint({ width, height, seed, shapes = 120 }) {
  const random = noise(seed);
  const between = (least, most) => least + ((most - least) * (random() + 1)) / 2;
  const values = new Uint8Array(3 * width * height);
  const palette = Array.from({ length: 7 }, () => [between(10, 245), between(10, 245), between(10, 245)].map(Math.round));
  const pick = () => palette[Math.floor(between(0, palette.length - 1e-6))];
  const paint = (left, top, right, bottom, color, inside) => {
    for (let y = Math.max(0, Math.floor(top)); y < Math.min(height, bottom); y++)
      for (let x = Math.max(0, Math.floor(left)); x < Math.min(width, right); x++)
        if (inside(x + 0.5, y + 0.5)) values.set(color, 3 * (y * width + x));
  };
  paint(0, 0, width, height, [236, 229, 214], () => true);
  const unit = Math.hypot(width, height);
  for (let shape = 0; shape < shapes; shape++) {
    const [x, y, size, color] = [between(0, width), between(0, height), unit * between(0.006, 0.07) , pick()];
    const kind = Math.floor(between(0, 3));
    if (kind === 0) paint(x - size, y - size, x + size, y + size, color, (px, py) => Math.hypot(px - x, py - y) < size);
    else if (kind === 1) {
      const [c, s] = [Math.cos(shape), Math.sin(shape)];
      const [long, short] = [size, size * between(0.1, 0.6)];
      const inBar = (px, py) =>
        Math.abs(c * (px - x) + s * (py - y)) < long && Math.abs(c * (py - y) - s * (px - x)) < short;
      paint(x - long, y - long, x + long, y + long, color, inBar);
    } else {
      for (let stroke = 0; stroke < 7; stroke++) {
        const [left, top] = [x + stroke * 0.012 * unit, y + unit * between(-0.003, 0.003)];
        paint(left, top, left + unit * between(0.003, 0.009), top + unit * between(0.006, 0.016), [24, 22, 30], () => true);
      }
    }
  }
  return { width, height, values };
}
