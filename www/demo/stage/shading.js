// The light on the sheet: what the camera saw divided by what is printed there, low-passed. A new print multiplied by
// it looks as if it lay in the same room.

import { LIGHT_FLOOR, LINEAR_OF_SRGB, MAX_LIGHT, luminanceOf } from "deepsft/light";

/** @import { TemplateLight } from "deepsft/light" */

/** Canonical pixels a side that are gathered in one cell of the shading map. */
const CELL = 4;

/**
 * Columns and rows of the shading map.
 *
 * @param {{ width: number, height: number }} canonical size of the canonical image
 */
export function shadingSize({ width, height }) {
  return { width: Math.ceil(width / CELL), height: Math.ceil(height / CELL) };
}

/** Two box blurs of this radius, in cells: about 8 canonical pixels, wider than the registration errs, narrower than folds. */
const BLUR_RADIUS = 2;

/**
 * One box blur along rows, then along columns, with zeros outside.
 *
 * @param {Float32Array} cells in place
 * @param {{ width: number, height: number }} size columns and rows
 */
function boxBlur(cells, { width, height }) {
  const line = new Float32Array(Math.max(width, height));
  const alongLine = (/** @type {number} */ start, /** @type {number} */ step, /** @type {number} */ length) => {
    for (let i = 0; i < length; i++) line[i] = cells[start + i * step];
    let sum = 0;
    for (let i = -BLUR_RADIUS; i < length; i++) {
      if (i + BLUR_RADIUS < length) sum += line[i + BLUR_RADIUS];
      if (i - BLUR_RADIUS - 1 >= 0) sum -= line[i - BLUR_RADIUS - 1];
      if (i >= 0) cells[start + i * step] = sum / (2 * BLUR_RADIUS + 1);
    }
  };
  for (let y = 0; y < height; y++) alongLine(y * width, 1, width);
  for (let x = 0; x < width; x++) alongLine(x, width, height);
}

/**
 * Shading of one frame.
 *
 * @param {{ data: Uint8ClampedArray, width: number, height: number }} canonical the canonical image, RGBA
 * @param {Float32Array} registration (u, v) for each canonical pixel
 * @param {Uint8Array} mask
 * @param {TemplateLight} template
 * @returns {Float32Array} of {@link shadingSize}, 1 where the image is as bright as the print
 */
export function shadingOf({ data, width, height }, registration, mask, template) {
  const { rgb } = template;
  const cells = shadingSize({ width, height });
  const seen = new Float32Array(cells.width * cells.height);
  const printed = new Float32Array(cells.width * cells.height);
  for (let y = 0, pixel = 0; y < height; y++) {
    const row = Math.floor(y / CELL) * cells.width;
    for (let x = 0; x < width; x++, pixel++) {
      if (mask[pixel] === 0) continue;
      const print = template.placeOf(registration[2 * pixel], registration[2 * pixel + 1]);
      const cell = row + Math.floor(x / CELL);
      const at = 4 * pixel;
      seen[cell] += LIGHT_FLOOR + luminanceOf(LINEAR_OF_SRGB[data[at]], LINEAR_OF_SRGB[data[at + 1]], LINEAR_OF_SRGB[data[at + 2]]);
      printed[cell] += LIGHT_FLOOR + luminanceOf(rgb[print], rgb[print + 1], rgb[print + 2]);
    }
  }
  for (const values of [seen, printed]) {
    boxBlur(values, cells);
    boxBlur(values, cells);
  }
  return seen.map((s, i) => (printed[i] > 1e-3 ? Math.min(MAX_LIGHT, s / printed[i]) : 1));
}

/**
 * Colour of the light on the sheet, from one pixel of each cell.
 *
 * @param {{ data: Uint8ClampedArray, width: number, height: number }} canonical as in {@link shadingOf}
 * @param {Float32Array} registration
 * @param {Uint8Array} mask
 * @param {TemplateLight} template
 * @returns {[number, number, number]} linear light, of mean luminance 1
 */
export function tintOf({ data, width, height }, registration, mask, template) {
  const [seen, printed] = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  for (let y = CELL >> 1; y < height; y += CELL) {
    for (let x = CELL >> 1; x < width; x += CELL) {
      const pixel = y * width + x;
      if (mask[pixel] === 0) continue;
      const print = template.placeOf(registration[2 * pixel], registration[2 * pixel + 1]);
      for (let k = 0; k < 3; k++) {
        seen[k] += LINEAR_OF_SRGB[data[4 * pixel + k]];
        printed[k] += template.rgb[print + k];
      }
    }
  }
  // Against nothing to divide by.
  const light = seen.map((s, k) => (s + 1e-3) / (printed[k] + 1e-3));
  const luminance = luminanceOf(light[0], light[1], light[2]);
  // Cameras and printers saturate: beyond a third the cast is not the light's.
  const [r, g, b] = light.map((c) => Math.min(1.33, Math.max(0.75, c / luminance)));
  return [r, g, b];
}
