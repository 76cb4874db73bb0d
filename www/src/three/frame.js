// The one conversion between our frame and that of three.js.

/**
 * Points or directions of the camera's frame (x right, y down, z forward) in that of a camera of three.js (x right, y up, z backward), or
 * back: half a turn about x is its own inverse. Lengths stay, so a unit is a millimetre in both.
 *
 * @param {Float32Array} from (x, y, z) each
 * @param {Float32Array} [to] filled; `from` itself when absent
 * @returns {Float32Array} `to`
 */
export function turnedFrame(from, to = from) {
  for (let i = 0; i < from.length; i += 3) {
    to[i] = from[i];
    to[i + 1] = -from[i + 1];
    to[i + 2] = -from[i + 2];
  }
  return to;
}
