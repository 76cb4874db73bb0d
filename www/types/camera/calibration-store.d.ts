/**
 * @param {string} key
 * @returns {number | null} focal length, pixels
 */
export declare function readCalibration(key: string): number | null;
/**
 * @param {string} key
 * @param {number | null} focal pixels; null forgets
 */
export declare function writeCalibration(key: string, focal: number | null): void;
