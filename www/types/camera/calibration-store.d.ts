export type Calibration = {
    focal: number;
    spread: number | null;
};
/** @param {string} key */
export declare function readCalibration(key: string): Calibration | null;
/**
 * @param {string} key
 * @param {Calibration | null} calibration null forgets
 */
export declare function writeCalibration(key: string, calibration: Calibration | null): void;
/**
 * Whether one calibration is surer than another: both deviations are known, and its own is the smaller part of the focal length.
 *
 * @param {Calibration} one
 * @param {Calibration} other
 */
export declare function isSurer(one: Calibration, other: Calibration): boolean;
