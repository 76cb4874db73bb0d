export type Position = [number, number, number];
export type Quaternion = [number, number, number, number];
/** @typedef {[number, number, number]} Position mm */
/** @typedef {[number, number, number, number]} Quaternion (x, y, z, w), of length 1 */
/** The One-Euro filter (Casiez, Roussel and Vogel 2012) of a position and an orientation. */
export declare class PoseFilter {
    #private;
    /** @param {number} [perMm] a millimetre in the unit of the positions */
    constructor(perMm?: number);
    /** Takes the next pose as it is. */
    reset(): void;
    /**
     * @param {Position} position replaced by the smooth one
     * @param {Quaternion} quaternion likewise
     * @param {number} atMs
     */
    apply(position: Position, quaternion: Quaternion, atMs: number): void;
}
