// The print in linear light: what the light on a sheet is told from.

/** Added to both sides of the quotient, linear light: dark print on a dark image says little about the light. */
export const LIGHT_FLOOR = 0.02;
/** Brightest shading: highlights of glossy paper. */
export const MAX_LIGHT = 2.5;

/** Columns of the template's copy in which its luminance is looked up: about a canonical pixel each. */
const LOOKUP_WIDTH = 256;

/** Linear light of an sRGB byte. */
export const LINEAR_OF_SRGB = Float32Array.from({ length: 256 }, (_, byte) => {
  const c = byte / 255;
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
});

/** Luminance of linear sRGB (Rec. 709). */
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** Template colours in linear light on a small grid. */
export class TemplateLight {
  /** @param {{ data: Uint8ClampedArray, width: number, height: number }} texture RGBA */
  constructor({ data, width, height }) {
    /** Columns of the grid. */
    this.width = Math.min(width, LOOKUP_WIDTH);
    /** Its rows. */
    this.height = Math.max(1, Math.round((height * this.width) / width));
    const sums = new Float32Array(3 * this.width * this.height);
    const counts = new Uint32Array(sums.length);
    for (let pixel = 0; pixel < width * height; pixel++) {
      const at = this.placeOf(((pixel % width) + 0.5) / width, (Math.floor(pixel / width) + 0.5) / height);
      for (let k = 0; k < 3; k++) {
        sums[at + k] += LINEAR_OF_SRGB[data[4 * pixel + k]];
        counts[at + k]++;
      }
    }
    /** Linear RGB, row-major: the mean over the pixels of each cell. */
    this.rgb = sums.map((sum, i) => sum / counts[i]);
  }

  /**
   * Where the colour of a place on the print begins in `rgb`.
   *
   * @param {number} u
   * @param {number} v
   */
  placeOf(u, v) {
    const column = Math.min(this.width - 1, Math.max(0, Math.floor(u * this.width)));
    const row = Math.min(this.height - 1, Math.max(0, Math.floor(v * this.height)));
    return 3 * (row * this.width + column);
  }

  /**
   * @param {number} u
   * @param {number} v
   * @returns {number} linear
   */
  luminanceAt(u, v) {
    const at = this.placeOf(u, v);
    return luminanceOf(this.rgb[at], this.rgb[at + 1], this.rgb[at + 2]);
  }
}

/**
 * Luminance of a colour, of linear light or of bytes as they are.
 *
 * @param {number} r
 * @param {number} g
 * @param {number} b
 */
export function luminanceOf(r, g, b) {
  return LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b;
}
