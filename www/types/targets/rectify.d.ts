export type PrintCorners = readonly [readonly [number, number], readonly [number, number], readonly [number, number], readonly [number, number]];
/**
 * Whether four corners run clockwise around a convex quadrilateral: only such a one is the view of a print's front.
 *
 * @param {PrintCorners} corners
 */
export declare function isPrintOutline(corners: PrintCorners): boolean;
/**
 * Width over height of a flat print, from its corners in a photograph by a known camera: the columns of K⁻¹H are the print's
 * two axes in space, as long as its sides (Zhang and He, Whiteboard scanning and image enhancement, 2007, section 3).
 *
 * @param {PrintCorners} corners
 * @param {{ fx: number, fy: number, cx: number, cy: number }} camera pixels of the same photograph; its distortion is neglected
 * @throws {DeepSftError} `invalid-argument` for corners that are no {@link isPrintOutline outline}
 */
export declare function printAspect(corners: PrintCorners, { fx, fy, cx, cy }: {
    fx: number;
    fy: number;
    cx: number;
    cy: number;
}): number;
/**
 * The print as a flat picture.
 *
 * @param {ImageData} photograph
 * @param {PrintCorners} corners
 * @param {number} width of the flat picture, pixels
 * @param {number} height
 * @returns {ImageData} opaque where the photograph is
 * @throws {DeepSftError} `invalid-argument` for corners that are no {@link isPrintOutline outline}
 */
export declare function rectifyPicture(photograph: ImageData, corners: PrintCorners, width: number, height: number): ImageData;
/**
 * The homography from a rectangle of `width` x `height` at the origin to the corners, row-major (Heckbert, Fundamentals of texture mapping and
 * image warping, 1989, section 2.2.3).
 *
 * @param {PrintCorners} corners
 * @param {number} width
 * @param {number} height
 */
export declare function outlineHomography(corners: PrintCorners, width: number, height: number): number[];
