// `deepsft/scene`: from a part of the page and a picture to a scene on the print. With three.js.

import { DeepSftError } from "../error.js";
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
export async function start(container, options = {}) {
  const { signal } = options;
  signal?.throwIfAborted();
  const place = typeof container === "string" ? document.querySelector(container) : container;
  if (!(place instanceof HTMLElement)) throw new DeepSftError("invalid-argument", `The page has no element ${container} to start a scene in.`);
  const view = new SceneView(place, options);
  try {
    await view.load();
    return view;
  } catch (error) {
    if (signal?.aborted || view.closed) view.close();
    else view.fail(error);
    signal?.throwIfAborted();
    throw error;
  }
}

export { SceneSheet } from "./scene-sheet.js";
export { SceneView } from "./scene-view.js";

/** @typedef {import("./print.js").PrintInput} PrintInput */
/** @typedef {import("./scene-options.js").SceneEvents} SceneEvents */
/** @typedef {import("./scene-options.js").SceneHost} SceneHost */
/** @typedef {import("./scene-options.js").SceneOptions} SceneOptions */
/** @typedef {import("./screens.js").OwnScreens} OwnScreens */
/** @typedef {import("./screens.js").ScreenContents} ScreenContents */
/** @typedef {import("./screens.js").ScreenName} ScreenName */
