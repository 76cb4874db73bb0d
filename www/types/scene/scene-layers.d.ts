import { FrameBackground } from "../three/frame-background.js";
import type { TrackedFrame } from "../index.js";
import type { SceneView } from "./scene-view.js";
export declare class SceneLayers {
    #private;
    /** Shows the camera's picture. */
    background: FrameBackground;
    /** What holds the canvases, and its size, CSS pixels. */
    element: HTMLDivElement;
    page: {
        width: number;
        height: number;
    };
    /**
     * @param {Pick<SceneView, "renderer" | "scene" | "camera" | "software">} view whose scene gets the camera's picture as its background
     * @param {boolean} isHosted whether the canvas is the page's own, and lies where it is
     */
    constructor(view: Pick<SceneView, "renderer" | "scene" | "camera" | "software">, isHosted: boolean);
    /** @param {boolean} isMirrored whether what is seen is mirrored */
    mirror(isMirrored: boolean): void;
    /**
     * Draws the scene, whose camera has the intrinsics of the frame.
     *
     * @param {TrackedFrame} tracked that is shown
     */
    draw({ frame, camera: intrinsics }: TrackedFrame): void;
    /**
     * What was just drawn, not mirrored, in the middle of a canvas.
     *
     * @param {HTMLCanvasElement} canvas
     * @param {string} background CSS colour of what is left of it, also where the window has turned since a recording began
     */
    drawInto(canvas: HTMLCanvasElement, background: string): HTMLCanvasElement;
    dispose(): void;
}
