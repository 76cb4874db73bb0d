/**
 * Found and lost with hysteresis, so that neither flickers. A target is found when three frames in a row confirm its mesh, each
 * with a correlation of 0.35 or more, or at once when one does with 0.8 or more. It is lost when no frame has
 * confirmed it for 0.4 seconds of the video.
 */
export declare class Presence {
    #private;
    get isFound(): boolean;
    /** Whether the newest frame confirms the mesh. */
    get isConfirmed(): boolean;
    /**
     * @param {number} correlation of the newest frame with the tracker's mesh, 0 to 1; 0 without a mesh
     * @param {number} atMs time of the frame, milliseconds, ascending
     * @returns {"found" | "lost" | null} what has changed
     */
    update(correlation: number, atMs: number): "found" | "lost" | null;
}
