// The light on the sheet: what the camera saw divided by what is printed there, low-passed. A new print multiplied by
// it looks as if it lay in the same room.

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

/** Added to both sides of the quotient, linear light: dark print on a dark image says little about the light. */
export const FLOOR = 0.02;
/** Brightest shading: highlights of glossy paper. */
export const MOST = 2.5;

/** Columns of the template's copy in which its luminance is looked up: about a canonical pixel each. */
const LOOKUP_WIDTH = 256;

/** Linear light of an sRGB byte. */
export const LINEAR = Float32Array.from({ length: 256 }, (_, byte) => {
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

  /**
   * @param {number} u
   * @param {number} v
   * @returns {number} linear
   */
  luminanceAt(u, v) {
    const at = placeIn(this, u, v);
    return luminanceOf(this.rgb[at], this.rgb[at + 1], this.rgb[at + 2]);
  }
}

/**
 * @param {TemplateLight} template
 * @param {number} u
 * @param {number} v
 */
function placeIn({ width, height }, u, v) {
  const column = Math.min(width - 1, Math.max(0, Math.floor(u * width)));
  const row = Math.min(height - 1, Math.max(0, Math.floor(v * height)));
  return 3 * (row * width + column);
}

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
 * The place in the template's light that a canonical pixel shows.
 *
 * @param {Float32Array} registration (u, v) for each canonical pixel
 * @param {number} pixel
 * @param {TemplateLight} template
 */
function printAt(registration, pixel, template) {
  return placeIn(template, registration[2 * pixel], registration[2 * pixel + 1]);
}

/**
 * Luminance of a colour in linear light.
 *
 * @param {number} r
 * @param {number} g
 * @param {number} b
 */
export function luminanceOf(r, g, b) {
  return LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b;
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
      const print = printAt(registration, pixel, template);
      const cell = row + Math.floor(x / CELL);
      const at = 4 * pixel;
      seen[cell] += FLOOR + luminanceOf(LINEAR[data[at]], LINEAR[data[at + 1]], LINEAR[data[at + 2]]);
      printed[cell] += FLOOR + luminanceOf(rgb[print], rgb[print + 1], rgb[print + 2]);
    }
  }
  for (const values of [seen, printed]) {
    boxBlur(values, cells);
    boxBlur(values, cells);
  }
  return seen.map((s, i) => (printed[i] > 1e-3 ? Math.min(MOST, s / printed[i]) : 1));
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
      const print = printAt(registration, pixel, template);
      for (let k = 0; k < 3; k++) {
        seen[k] += LINEAR[data[4 * pixel + k]];
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
