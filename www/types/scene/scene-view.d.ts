import { Scene, WebGLRenderer } from "three";
import { Announcer } from "../announcer.js";
import { CameraStream } from "../camera/camera-stream.js";
import { DeepSftError } from "../error.js";
import { Recording } from "../record/recording.js";
import { FrameCamera } from "../three/frame-camera.js";
import { SceneSheet } from "./scene-sheet.js";
import type { ImageInput, PictureOptions, Target } from "../index.js";
import type { SceneEvents, SceneOptions } from "./index.js";
/** A scene that runs until it is closed. {@link start} makes it. @extends {Announcer<SceneEvents>} */
export declare class SceneView extends Announcer<SceneEvents> {
    #private;
    /** Whether the processor does the drawing. */
    software: boolean;
    renderer: WebGLRenderer;
    /** The scene of three.js; the camera stands in its origin. A unit is a millimetre. */
    scene: Scene<import("three").Object3DEventMap>;
    /** Sees what the video's camera sees. @type {FrameCamera} */
    camera: FrameCamera;
    /** The camera that is open. @type {CameraStream | null} */
    stream: CameraStream | null;
    /** Why it stands still. @type {DeepSftError | null} */
    error: DeepSftError | null;
    /** Time the last drawing took, milliseconds. */
    drawMs: number;
    /**
     * Use {@link start}.
     *
     * @param {HTMLElement} container
     * @param {SceneOptions} options
     * @throws {DeepSftError} `browser-unsupported` without WebGL 2
     */
    constructor(container: HTMLElement, options: SceneOptions);
    /** The element that it is drawn on. */
    get canvas(): HTMLCanvasElement;
    /** What is looked for. */
    get targets(): Target[];
    /** Whether it is over. */
    get closed(): boolean;
    /** Loads what is looked for, while the person is asked for the camera; called by {@link start}. */
    load(): Promise<void>;
    /**
     * Looks for another picture too.
     *
     * @param {ImageInput} picture
     * @param {PictureOptions} [options]
     * @throws {DeepSftError} as `sft.addPicture`
     */
    addPicture(picture: ImageInput, options?: PictureOptions): Promise<SceneSheet>;
    /**
     * A print in the scene.
     *
     * @param {Target} [target] the first when absent
     * @returns {SceneSheet} the same for the same target
     * @throws {DeepSftError} `target-unknown`
     */
    sheet(target?: Target): SceneSheet;
    /** What is seen now, not mirrored, as a PNG. */
    shot(): Promise<Blob>;
    /**
     * Records what is seen from now on, for two minutes at most.
     *
     * @returns {Recording} `await recording.stop()` is the video
     * @throws {DeepSftError} `browser-unsupported`
     */
    record(): Recording;
    /** Draws anew what a page has changed: the scene draws by itself what moves with the camera's picture. */
    refresh(): void;
    /** Whether it is to be drawn: a processor that draws has better things to do than to draw the same once more. */
    get due(): boolean;
    /** Takes over the newest frame, and fires `frame`: a {@link SceneHost} calls it before each drawing. @param {number} [now] milliseconds */
    prepare(now?: number): void;
    /** Records what was just drawn; a {@link SceneHost} calls it after each drawing. */
    drawn(): void;
    /** Ends it, frees the camera, and takes it out of the page. Models that were added stay the page's. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
    /** Ends it, and leaves why in the page; called by {@link start}. @param {unknown} error */
    fail(error: unknown): void;
}
