import { Mesh } from "three";
/**
 * A frame of the video, where the {@link FrameCamera} that renders the scene sees it. Content lies on it exactly because it is the frame
 * that was tracked, not what the video shows by now. Of a lens that distorts it shows what a pinhole would see.
 *
 * For `WebGLRenderer`. Elsewhere lay the canvas over the video element, with `object-fit: cover`.
 */
export declare class FrameBackground extends Mesh {
    #private;
    constructor();
    /**
     * Shows a frame from the next rendering on.
     *
     * @param {{ frame: ImageBitmap | HTMLVideoElement | null, keep?: () => void, close?: () => void }} tracked a `TrackedFrame` or an
     *   `Estimate`, kept, and closed when the next one is shown. A video may be given in its place: `{ frame: video }`.
     */
    show(tracked: {
        frame: ImageBitmap | HTMLVideoElement | null;
        keep?: () => void;
        close?: () => void;
    }): void;
    /** Lets frame, texture and material go. */
    dispose(): void;
    /** Not a thing that rays hit. @override */
    raycast(): void;
}
