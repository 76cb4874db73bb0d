import { Scene, WebGLRenderer } from "three";
import { CameraStream } from "../camera/camera-stream.js";
import { DeepSft } from "../deepsft.js";
import { DeepSftError } from "../error.js";
import { Recording } from "../record/recording.js";
import { TrackedFrame } from "../results/tracked-frame.js";
import { FrameCamera } from "../three/frame-camera.js";
import { SceneSheet } from "./scene-sheet.js";
import type { CameraOption } from "../camera/intrinsics.js";
import type { Facing } from "../camera/request.js";
import type { LoadOptions, PictureOptions } from "../deepsft.js";
import type { ModelInput } from "../engine/bundle.js";
import type { ImageInput } from "../frames/image-input.js";
import type { Estimate } from "../results/estimate.js";
import type { Target } from "../targets/target.js";
import type { FrameFit } from "../three/frame-camera.js";
import type { FrameSource } from "../tracking/session.js";
import type { Smoothing } from "../tracking/tracker-worker.js";
import type { OwnScreens } from "./screens.js";
export type SceneOptions = {
    /**
     * what is printed and looked for; more with {@link SceneView.addPicture}
     */
    picture?: ImageInput;
    /**
     * width of the print, without the paper's margins
     */
    widthMm?: number;
    /**
     * its height
     */
    heightMm?: number;
    /**
     * diameter of the tin, bottle or tube that it goes around
     */
    aroundMm?: number;
    /**
     * of it, for people
     */
    name?: string;
    /**
     * a trained model, whose target is looked for too
     */
    model?: ModelInput | null;
    /**
     * an engine of the page's own, which is not closed with the scene; its targets are looked for
     */
    sft?: DeepSft;
    /**
     * those of them that are looked for, default all
     */
    targets?: Target[];
    /**
     * what is shown in place of a camera: a video that plays, an open camera, or frames of one's own
     */
    source?: FrameSource;
    /**
     * what is shown in place of a video: one picture, which the first target is looked for in
     */
    photograph?: ImageInput;
    /**
     * intrinsics of the source, where they are known
     */
    camera?: CameraOption;
    /**
     * how the camera's picture fills the container, default `cover`
     */
    fit?: FrameFit;
    /**
     * which way the camera looks, default `environment`; the picture of one that looks at the person is mirrored
     */
    facing?: Facing;
    /**
     * a certain camera
     */
    deviceId?: string;
    /**
     * as in `sft.follow`; default true
     */
    smooth?: boolean | Smoothing;
    /**
     * whether what stands on a print is lit as its paper is and casts a shadow on it; default true
     */
    light?: boolean;
    /**
     * whether a button offers the sound of films that have one; default true
     */
    sound?: boolean;
    /**
     * in place of those of the package; false for none
     */
    screens?: OwnScreens | false;
    /**
     * options of `DeepSft.load`
     */
    load?: Pick<LoadOptions, "device" | "baseUrl" | "onProgress">;
    /**
     * as in `sft.follow`; the scene closes the estimate
     */
    onEstimate?: (estimate: Estimate, frame: number) => void;
    /**
     * closes the scene
     */
    signal?: AbortSignal;
};
export type SceneEvents = {
    /**
     * a print is found
     */
    found: CustomEvent<{
        sheet: SceneSheet;
        frame: TrackedFrame;
    }>;
    /**
     * it is found no longer
     */
    lost: CustomEvent<{
        sheet: SceneSheet;
        frame: TrackedFrame;
    }>;
    /**
     * before each drawing: seconds since the last, and the newest frame
     */
    frame: CustomEvent<{
        deltaS: number;
        frame: TrackedFrame;
    }>;
    /**
     * the camera, or what follows it, has failed; the screen offers to try again
     */
    error: CustomEvent<{
        error: DeepSftError;
    }>;
};
/** A scene that runs until it is closed. {@link start} makes it. */
export declare class SceneView extends EventTarget {
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
    /**
     * @template {keyof SceneEvents} Name
     * @param {Name} name
     * @param {((event: SceneEvents[Name]) => void) | EventListenerObject | null} listener
     * @param {AddEventListenerOptions | boolean} [options]
     * @override
     */
    addEventListener<Name extends keyof SceneEvents>(name: Name, listener: ((event: SceneEvents[Name]) => void) | EventListenerObject | null, options?: AddEventListenerOptions | boolean): void;
    /** Loads what is looked for, while the person is asked for the camera; called by {@link start}. */
    load(): Promise<void>;
    /**
     * Looks for another picture too.
     *
     * @param {ImageInput} picture
     * @param {PictureOptions} [options]
     * @returns {Promise<SceneSheet>}
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
    /**
     * What is seen now, not mirrored, as a PNG.
     *
     * @returns {Promise<Blob>}
     */
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
    /** Ends it, frees the camera, and takes it out of the page. Models that were added stay the page's. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
    /** Ends it, and leaves why in the page; called by {@link start}. @param {unknown} error */
    fail(error: unknown): void;
}
