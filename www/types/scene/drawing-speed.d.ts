/** Whether the browser says that the processor does the drawing, or offers no WebGL 2. Asked once. */
export declare function drawsInSoftware(): boolean;
/** Judges by the time from drawing to drawing: some browsers tell nobody that the processor draws (WebKit). */
export declare class Pace {
    #private;
    /**
     * Takes over a drawing that is due.
     *
     * @param {number} now milliseconds
     */
    isSlow(now: number): boolean;
}
