import type { Scene, WebGLRenderer } from "three";
import type { TrackedFrame } from "../results/tracked-frame.js";
import type { FrameCamera } from "../three/frame-camera.js";
export declare class SceneLayers {
    #private;
    /** What holds the canvases. */
    element: HTMLDivElement;
    /**
     * @param {WebGLRenderer} renderer
     * @param {Scene} scene gets the camera's picture as its background
     * @param {FrameCamera} camera
     * @param {boolean} isHosted whether the canvas is the page's own, and lies where it is
     */
    constructor(renderer: WebGLRenderer, scene: Scene, camera: FrameCamera, isHosted: boolean);
    /** Whether what is seen is mirrored. */
    get mirrored(): boolean;
    /** @param {boolean} mirrored */
    set mirrored(mirrored: boolean);
    /** Shows a frame from the next drawing on; it is kept until there is another. @param {TrackedFrame} tracked */
    show(tracked: TrackedFrame): void;
    /**
     * Draws the scene, whose camera has the intrinsics of the frame.
     *
     * @param {TrackedFrame} tracked that is shown
     * @param {{ width: number, height: number }} page the size of it all, CSS pixels
     * @param {boolean} software whether the processor does the drawing
     */
    draw({ frame, camera: intrinsics }: TrackedFrame, page: {
        width: number;
        height: number;
    }, software: boolean): void;
    /**
     * What was just drawn, not mirrored, in the middle of a canvas.
     *
     * @param {HTMLCanvasElement} canvas
     * @param {string} background CSS colour of what is left of it, also where the window has turned since a recording began
     */
    drawInto(canvas: HTMLCanvasElement, background: string): HTMLCanvasElement;
    dispose(): void;
}
