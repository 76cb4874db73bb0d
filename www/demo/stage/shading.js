// The light on the sheet: what the camera saw divided by what is printed there, low-passed. A new print multiplied by
// it looks as if it lay in the same room.

import { CANONICAL_HEIGHT, CANONICAL_WIDTH } from "deepsft";

/** Canonical pixels a side that are gathered in one cell of the shading map. */
const CELL = 4;
export const SHADING_WIDTH = Math.ceil(CANONICAL_WIDTH / CELL);
export const SHADING_HEIGHT = Math.ceil(CANONICAL_HEIGHT / CELL);

/** Two box blurs of this radius, in cells: about 8 canonical pixels, wider than the registration errs, narrower than folds. */
const BLUR_RADIUS = 2;

/** Added to both sides of the quotient, linear light: dark print on a dark image says little about the light. */
const FLOOR = 0.02;
/** Brightest shading: highlights of glossy paper. */
const MOST = 2.5;

/** Columns of the template's copy in which its luminance is looked up: about a canonical pixel each. */
const LOOKUP_WIDTH = 256;

/** Linear light of an sRGB byte. */
const LINEAR = Float32Array.from({ length: 256 }, (_, byte) => {
  const c = byte / 255;
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
});

/** Luminance of linear sRGB (Rec. 709). */
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** Template colours in linear light on a small grid. */
export class TemplateLight {
  /** @param {{ data: Uint8ClampedArray, width: number, height: number }} texture RGBA */
  constructor({ data, width, height }) {
    this.width = Math.min(width, LOOKUP_WIDTH);
    this.height = Math.max(1, Math.round((height * this.width) / width));
    /** Linear RGB, row-major: the mean over the pixels of each cell. */
    this.rgb = new Float32Array(3 * this.width * this.height);
    for (let y = 0; y < this.height; y++) {
      const [top, bottom] = [Math.floor((y * height) / this.height), Math.ceil(((y + 1) * height) / this.height)];
      for (let x = 0; x < this.width; x++) {
        const [left, right] = [Math.floor((x * width) / this.width), Math.ceil(((x + 1) * width) / this.width)];
        const weight = 1 / ((bottom - top) * (right - left));
        for (let j = top; j < bottom; j++) {
          for (let i = left; i < right; i++) {
            for (let k = 0; k < 3; k++)
              this.rgb[3 * (y * this.width + x) + k] += LINEAR[data[4 * (j * width + i) + k]] * weight;
          }
        }
      }
    }
  }
}

/**
 * One box blur along rows, then along columns, with zeros outside.
 *
 * @param {Float32Array} cells SHADING_WIDTH x SHADING_HEIGHT, in place
 */
function boxBlur(cells) {
  const line = new Float32Array(Math.max(SHADING_WIDTH, SHADING_HEIGHT));
  const alongLine = (/** @type {number} */ start, /** @type {number} */ step, /** @type {number} */ length) => {
    for (let i = 0; i < length; i++) line[i] = cells[start + i * step];
    let sum = 0;
    for (let i = -BLUR_RADIUS; i < length; i++) {
      if (i + BLUR_RADIUS < length) sum += line[i + BLUR_RADIUS];
      if (i - BLUR_RADIUS - 1 >= 0) sum -= line[i - BLUR_RADIUS - 1];
      if (i >= 0) cells[start + i * step] = sum / (2 * BLUR_RADIUS + 1);
    }
  };
  for (let y = 0; y < SHADING_HEIGHT; y++) alongLine(y * SHADING_WIDTH, 1, SHADING_WIDTH);
  for (let x = 0; x < SHADING_WIDTH; x++) alongLine(x, SHADING_WIDTH, SHADING_HEIGHT);
}

/**
 * Shading of one frame.
 *
 * @param {Uint8ClampedArray} canonical RGBA of the canonical image
 * @param {Float32Array} registration (u, v) for each canonical pixel
 * @param {Uint8Array} mask
 * @param {TemplateLight} template
 * @returns {{ shading: Float32Array, tint: [number, number, number] }} shading: SHADING_WIDTH x SHADING_HEIGHT, 1 where
 *   the image is as bright as the print; tint: the colour of the light, of mean luminance 1
 */
export function shadingOf(canonical, registration, mask, template) {
  const [seen, printed] = [
    new Float32Array(SHADING_WIDTH * SHADING_HEIGHT),
    new Float32Array(SHADING_WIDTH * SHADING_HEIGHT),
  ];
  const [seenRgb, printedRgb] = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  for (let y = 0, pixel = 0; y < CANONICAL_HEIGHT; y++) {
    for (let x = 0; x < CANONICAL_WIDTH; x++, pixel++) {
      if (mask[pixel] === 0) continue;
      const u = Math.min(template.width - 1, Math.max(0, Math.floor(registration[2 * pixel] * template.width)));
      const v = Math.min(template.height - 1, Math.max(0, Math.floor(registration[2 * pixel + 1] * template.height)));
      const print = 3 * (v * template.width + u);
      const cell = Math.floor(y / CELL) * SHADING_WIDTH + Math.floor(x / CELL);
      seen[cell] += FLOOR;
      printed[cell] += FLOOR;
      for (let k = 0; k < 3; k++) {
        const [s, p] = [LINEAR[canonical[4 * pixel + k]], template.rgb[print + k]];
        seen[cell] += LUMINANCE[k] * s;
        printed[cell] += LUMINANCE[k] * p;
        seenRgb[k] += s;
        printedRgb[k] += p;
      }
    }
  }
  for (const cells of [seen, printed]) {
    boxBlur(cells);
    boxBlur(cells);
  }
  const shading = seen.map((s, i) => (printed[i] > 1e-3 ? Math.min(MOST, s / printed[i]) : 1));
  return { shading, tint: tintOf(seenRgb, printedRgb) };
}

/**
 * @param {number[]} seen sums of linear RGB
 * @param {number[]} printed
 * @returns {[number, number, number]}
 */
function tintOf(seen, printed) {
  const light = seen.map((s, k) => (s + 1e-3) / (printed[k] + 1e-3));
  const luminance = light.reduce((sum, c, k) => sum + LUMINANCE[k] * c, 0);
  // Cameras and printers saturate: beyond a third the cast is not the light's.
  const [r, g, b] = light.map((c) => Math.min(1.33, Math.max(0.75, c / luminance)));
  return [r, g, b];
}
