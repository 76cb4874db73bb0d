import { SceneView } from "./scene-view.js";
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
export type SceneEvents = import("./scene-options.js").SceneEvents;
export type SceneHost = import("./scene-options.js").SceneHost;
export type SceneOptions = import("./scene-options.js").SceneOptions;
export type OwnScreens = import("./screens.js").OwnScreens;
export type ScreenContents = import("./screens.js").ScreenContents;
export type ScreenName = import("./screens.js").ScreenName;
/** @typedef {import("./print.js").PrintInput} PrintInput */
/** @typedef {import("./scene-options.js").SceneEvents} SceneEvents */
/** @typedef {import("./scene-options.js").SceneHost} SceneHost */
/** @typedef {import("./scene-options.js").SceneOptions} SceneOptions */
/** @typedef {import("./screens.js").OwnScreens} OwnScreens */
/** @typedef {import("./screens.js").ScreenContents} ScreenContents */
/** @typedef {import("./screens.js").ScreenName} ScreenName */
