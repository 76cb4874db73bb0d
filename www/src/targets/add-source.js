// Adding a target in a worker: the engine and the tracker take the same.

import { DeepSftError } from "../error.js";

/** @import { Engine, MeshTracker } from "../../pkg/deepsft_web.js" */
/** @import { TargetSource } from "./target-source.js" */

/**
 * @param {Engine | MeshTracker} to
 * @param {number} id
 * @param {TargetSource} source
 */
export async function addSource(to, id, source) {
  if (source.kind === "picture") {
    const { pixels, widthMm, heightMm, diameterMm } = source;
    await to.addPicture(id, pixels.data, pixels.width, pixels.height, widthMm, heightMm, diameterMm);
  } else if (source.kind === "scan") await to.addScan(id, source.files, source.mmPerUnit);
  else if (source.kind === "template") await to.addTemplate(id, source.files);
  else if ("addModel" in to) await to.addModel(id, source.files);
  else throw new DeepSftError("internal", "The engine has its model from the start.");
}
