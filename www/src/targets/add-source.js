// Adding a target in a worker: the engine and the tracker take the same.

import { TargetTemplate } from "../../pkg/deepsft_web.js";
import { DeepSftError } from "../error.js";
import { decodedPixels } from "../frames/image-input.js";

/** @import { Engine, MeshTracker } from "../../pkg/deepsft_web.js" */
/** @import { TargetSource } from "./target-source.js" */

/**
 * @param {Engine | MeshTracker} to
 * @param {number} id
 * @param {TargetSource} source
 * @returns {Promise<{ id: number, share: number }[]>} the targets that resemble it, where it is the engine's
 */
export async function addSource(to, id, source) {
  if (source.kind !== "model") {
    const alike = (await to.addTarget(id, await templateOf(source))) ?? [];
    if (source.kind === "picture" && source.copies > 1) await to.lookForCopies(id, source.copies);
    return alike;
  }
  if (!("addModel" in to)) throw new DeepSftError("internal", "The engine has its model from the start.");
  await to.addModel(id, source.files);
  return [];
}

/** @param {Exclude<TargetSource, { kind: "model" }>} source */
function templateOf(source) {
  if (source.kind === "template") return TargetTemplate.ofFolder(source.files);
  if (source.kind === "scan") return TargetTemplate.ofScan(source.files, source.mmPerUnit, decodedPixels);
  const { pixels, widthMm, heightMm, diameterMm } = source;
  return TargetTemplate.ofPicture(pixels.data, pixels.width, pixels.height, widthMm, heightMm, diameterMm);
}
