import { Quaternion, Vector3 } from "three";
/** The One-Euro filter (Casiez, Roussel and Vogel 2012) of a position and an orientation. */
export declare class PoseFilter {
    #private;
    /** Takes the next pose as it is. */
    reset(): void;
    /**
     * @param {Vector3} position mm, replaced by the smooth one
     * @param {Quaternion} quaternion likewise
     * @param {number} atMs
     */
    apply(position: Vector3, quaternion: Quaternion, atMs: number): void;
}
