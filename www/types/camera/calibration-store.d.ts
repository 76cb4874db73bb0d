export type Calibration = {
    focal: number;
    spread: number | null;
};
/** @param {string} key */
export declare function readCalibration(key: string): Calibration | null;
/**
 * Keeps a calibration unless a surer one is kept: both deviations are known, and that one's is the smaller part of its focal length.
 *
 * @param {string} key
 * @param {Calibration | null} calibration null forgets
 * @returns {boolean} whether it is what is kept now
 */
export declare function keepCalibration(key: string, calibration: Calibration | null): boolean;
