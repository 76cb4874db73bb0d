import type { Engine, MeshTracker } from "../../pkg/deepsft_web.js";
import type { TargetSource } from "./target-source.js";
/** @import { Engine, MeshTracker } from "../../pkg/deepsft_web.js" */
/** @import { TargetSource } from "./target-source.js" */
/**
 * @param {Engine | MeshTracker} to
 * @param {number} id
 * @param {TargetSource} source
 * @returns {Promise<{ id: number, share: number }[]>} the targets that resemble it, where it is the engine's
 */
export declare function addSource(to: Engine | MeshTracker, id: number, source: TargetSource): Promise<{
    id: number;
    share: number;
}[]>;
