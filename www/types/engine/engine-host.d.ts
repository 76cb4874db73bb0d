import type { EngineInfo, EngineTemplate, EstimateRequest, MeshRequest, RawEstimate, RawMesh, StartRequest } from "./engine-worker.js";
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
export declare function estimate({ frame, intrinsics, fit }: EstimateRequest): Promise<{
    value: RawEstimate;
    transfer: Transferable[];
}>;
/**
 * @param {MeshRequest} request
 * @returns {Promise<{ value: RawMesh | null, transfer: Transferable[] }>}
 */
export declare function mesh(request: MeshRequest): Promise<{
    value: RawMesh | null;
    transfer: Transferable[];
}>;
