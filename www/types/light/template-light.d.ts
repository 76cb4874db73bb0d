/** Added to both sides of the quotient, linear light: dark print on a dark image says little about the light. */
export declare const LIGHT_FLOOR = 0.02;
/** Brightest shading: highlights of glossy paper. */
export declare const MAX_LIGHT = 2.5;
/** Linear light of an sRGB byte. */
export declare const LINEAR_OF_SRGB: Float32Array<ArrayBuffer>;
/** Template colours in linear light on a small grid. */
export declare class TemplateLight {
    /** Columns of the grid. */
    width: number;
    /** Its rows. */
    height: number;
    /** Linear RGB, row-major: the mean over the pixels of each cell. */
    rgb: Float32Array<ArrayBuffer>;
    /** @param {{ data: Uint8ClampedArray, width: number, height: number }} texture RGBA */
    constructor({ data, width, height }: {
        data: Uint8ClampedArray;
        width: number;
        height: number;
    });
    /**
     * Where the colour of a place on the print begins in `rgb`.
     *
     * @param {number} u
     * @param {number} v
     */
    placeOf(u: number, v: number): number;
    /**
     * @param {number} u
     * @param {number} v
     * @returns {number} linear
     */
    luminanceAt(u: number, v: number): number;
}
/**
 * Luminance of a colour, of linear light or of bytes as they are.
 *
 * @param {number} r
 * @param {number} g
 * @param {number} b
 */
export declare function luminanceOf(r: number, g: number, b: number): number;
