import type { EngineInfo, EngineTemplate, EstimateRequest, RawEstimate, RawRefined, RefineRequest, StartRequest } from "./engine-worker.js";
/**
 * @param {StartRequest} request
 * @returns {Promise<{ value: { info: EngineInfo, template: EngineTemplate }, transfer: Transferable[] }>}
 */
export declare function start({ module, files, device: wanted }: StartRequest): Promise<{
    value: {
        info: EngineInfo;
        template: EngineTemplate;
    };
    transfer: Transferable[];
}>;
/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
export declare function estimate({ frame, intrinsics, refine: wantsPhysics }: EstimateRequest): Promise<{
    value: RawEstimate;
    transfer: Transferable[];
}>;
/**
 * @param {RefineRequest} request
 * @returns {Promise<{ value: RawRefined | null, transfer: Transferable[] }>}
 */
export declare function refine(request: RefineRequest): Promise<{
    value: RawRefined | null;
    transfer: Transferable[];
}>;
