/**
 * Points or directions of the camera's frame (x right, y down, z forward) in that of a camera of three.js (x right, y up, z backward), or
 * back: half a turn about x is its own inverse. Lengths stay, so a unit is a millimetre in both.
 *
 * @param {Float32Array} from (x, y, z) each
 * @param {Float32Array} [to] filled; `from` itself when absent
 * @returns {Float32Array} `to`
 */
export declare function turnedFrame(from: Float32Array, to?: Float32Array): Float32Array;
