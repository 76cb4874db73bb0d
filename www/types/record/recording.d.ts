/** What this browser records canvases as; undefined where it does not. */
export declare const recordingKind: string | undefined;
/**
 * A canvas for pictures and recordings of a part of the page. Both its sides are even, for video coders.
 *
 * @param {{ clientWidth: number, clientHeight: number }} area
 * @returns {HTMLCanvasElement}
 */
export declare function recordingCanvas({ clientWidth, clientHeight }: {
    clientWidth: number;
    clientHeight: number;
}): HTMLCanvasElement;
/**
 * What a canvas shows, as a PNG. What WebGL has drawn is there only until the browser shows it: call it right after drawing.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {Promise<Blob>}
 * @throws {DeepSftError} `internal`
 */
export declare function pictureOf(canvas: HTMLCanvasElement): Promise<Blob>;
/** A recording of a canvas that is under way. It ends by itself after two minutes. */
export declare class Recording {
    #private;
    /** Once it has ended. @type {Promise<Blob>} */
    finished: Promise<Blob>;
    /**
     * @param {HTMLCanvasElement} canvas of even sides, whose size stays
     * @throws {DeepSftError} `browser-unsupported` where {@link recordingKind} is undefined
     */
    constructor(canvas: HTMLCanvasElement);
    /** Ends it. @returns {Promise<Blob>} what was recorded */
    stop(): Promise<Blob>;
}
/**
 * Hands a file to the person: by the system's share sheet where browsers take files for it, else as a download.
 *
 * @param {Blob} blob
 * @param {string} name without its ending
 */
export declare function shareFile(blob: Blob, name: string): Promise<void>;
