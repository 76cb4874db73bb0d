export type Homography = {
    matrix: number[];
    rms: number;
};
/**
 * @param {readonly number[]} h
 * @param {readonly [number, number]} point
 * @returns {[number, number]}
 */
export declare function applyHomography(h: readonly number[], [x, y]: readonly [number, number]): [number, number];
/**
 * Robust least-squares homography from plane points to image points.
 *
 * @param {readonly [number, number][]} plane
 * @param {readonly [number, number][]} image one for each plane point
 * @returns {Homography | null} null when fewer than four points are left or they do not determine it
 */
export declare function fitHomography(plane: readonly [number, number][], image: readonly [number, number][]): Homography | null;
