import { DeepSftError } from "../error.js";
import { SceneView } from "./scene-view.js";
import type { Scene, WebGLRenderer } from "three";
import type { CameraOption, DeepSft, Estimate, Facing, FrameSource, ImageInput, LoadOptions, Smoothing, Target, TrackedFrame } from "../index.js";
import type { ModelInput } from "../engine/bundle.js";
import type { FrameFit } from "../three/frame-camera.js";
import type { SceneSheet } from "./scene-sheet.js";
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
     * what draws the scene in place of its own renderer
     */
    host?: SceneHost;
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
export type SceneHost = {
    renderer: WebGLRenderer;
    scene: Scene;
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
/** @import { Scene, WebGLRenderer } from "three" */
/** @import { CameraOption, DeepSft, Estimate, Facing, FrameSource, ImageInput, LoadOptions, Smoothing, Target, TrackedFrame } from "../index.js" */
/** @import { ModelInput } from "../engine/bundle.js" */
/** @import { FrameFit } from "../three/frame-camera.js" */
/** @import { SceneSheet } from "./scene-sheet.js" */
/**
 * @typedef {object} SceneOptions
 * @property {ImageInput} [picture] what is printed and looked for; more with {@link SceneView.addPicture}
 * @property {number} [widthMm] width of the print, without the paper's margins
 * @property {number} [heightMm] its height
 * @property {number} [aroundMm] diameter of the tin, bottle or tube that it goes around
 * @property {string} [name] of it, for people
 * @property {ModelInput | null} [model] a trained model, whose target is looked for too
 * @property {DeepSft} [sft] an engine of the page's own, which is not closed with the scene; its targets are looked for
 * @property {Target[]} [targets] those of them that are looked for, default all
 * @property {FrameSource} [source] what is shown in place of a camera: a video that plays, an open camera, or frames of one's own
 * @property {ImageInput} [photograph] what is shown in place of a video: one picture, which the first target is looked for in
 * @property {CameraOption} [camera] intrinsics of the source, where they are known
 * @property {SceneHost} [host] what draws the scene in place of its own renderer
 * @property {FrameFit} [fit] how the camera's picture fills the container, default `cover`
 * @property {Facing} [facing] which way the camera looks, default `environment`; the picture of one that looks at the person is mirrored
 * @property {string} [deviceId] a certain camera
 * @property {boolean | Smoothing} [smooth] as in `sft.follow`; default true
 * @property {boolean} [light] whether what stands on a print is lit as its paper is and casts a shadow on it; default true
 * @property {boolean} [sound] whether a button offers the sound of films that have one; default true
 * @property {OwnScreens | false} [screens] in place of those of the package; false for none
 * @property {Pick<LoadOptions, "device" | "baseUrl" | "onProgress">} [load] options of `DeepSft.load`
 * @property {(estimate: Estimate, frame: number) => void} [onEstimate] as in `sft.follow`; the scene closes the estimate
 * @property {AbortSignal} [signal] closes the scene
 */
/**
 * A renderer and a scene of the page's own, whose canvas fills the container. The page draws them by itself, with `view.camera`: between
 * {@link SceneView.prepare} and {@link SceneView.drawn}.
 *
 * @typedef {{ renderer: WebGLRenderer, scene: Scene }} SceneHost
 */
/**
 * The events of a scene, by what their `detail` holds.
 *
 * @typedef {object} SceneEvents
 * @property {CustomEvent<{ sheet: SceneSheet, frame: TrackedFrame }>} found a print is found
 * @property {CustomEvent<{ sheet: SceneSheet, frame: TrackedFrame }>} lost it is found no longer
 * @property {CustomEvent<{ deltaS: number, frame: TrackedFrame }>} frame before each drawing: seconds since the last, and the newest frame
 * @property {CustomEvent<{ error: DeepSftError }>} error the camera, or what follows it, has failed; the screen offers to try again
 */
/**
 * Starts a scene in a part of the page: it asks for the camera, looks for the print, and draws what is put on it.
 *
 * @param {HTMLElement | string} container what it fills, or a selector of it
 * @param {SceneOptions} [options]
 * @returns {Promise<SceneView>} once the picture is known; the camera may still be asked for
 * @throws {DeepSftError} as `DeepSft.load` and `sft.addPicture`, `browser-unsupported`: the container then says why. What becomes of the
 *   camera is told by the event `error`.
 * @throws {DeepSftError} `invalid-argument` where there is no such container
 */
export declare function start(container: HTMLElement | string, options?: SceneOptions): Promise<SceneView>;
export { SceneSheet } from "./scene-sheet.js";
export { SceneView } from "./scene-view.js";
export type PrintInput = import("./print.js").PrintInput;
export type OwnScreens = import("./screens.js").OwnScreens;
export type ScreenContents = import("./screens.js").ScreenContents;
export type ScreenName = import("./screens.js").ScreenName;
/** @typedef {import("./print.js").PrintInput} PrintInput */
/** @typedef {import("./screens.js").OwnScreens} OwnScreens */
/** @typedef {import("./screens.js").ScreenContents} ScreenContents */
/** @typedef {import("./screens.js").ScreenName} ScreenName */
