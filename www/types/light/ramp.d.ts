export type Range = {
    from: number;
    fully: number;
};
/** @typedef {{ from: number, fully: number }} Range where it begins to count, and where it counts fully */
/**
 * @param {number} value
 * @param {Range} range
 * @returns {number} 0 to 1
 */
export declare function ramp(value: number, { from, fully }: Range): number;
/** As `ramp`, gently at both ends. @param {number} value @param {Range} range */
export declare function gentleRamp(value: number, range: Range): number;
