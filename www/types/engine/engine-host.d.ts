import type { EngineInfo, EstimateRequest, FindRequest, MeshRequest, RawEstimate, RawFinding, RawMesh, StartRequest, TargetDescription, TargetRequest } from "./engine-worker.js";
/**
 * @param {StartRequest} request
 * @returns {Promise<{ value: { info: EngineInfo, model: TargetDescription | null }, transfer: Transferable[] }>}
 */
export declare function start({ module, files, device: wanted }: StartRequest): Promise<{
    value: {
        info: EngineInfo;
        model: TargetDescription | null;
    };
    transfer: Transferable[];
}>;
/**
 * @param {TargetRequest} request
 * @returns {Promise<{ value: TargetDescription, transfer: Transferable[] }>}
 */
export declare function addTarget({ id, source }: TargetRequest): Promise<{
    value: TargetDescription;
    transfer: Transferable[];
}>;
/** @param {{ id: number }} request */
export declare function removeTarget({ id }: {
    id: number;
}): {
    value: undefined;
    transfer: never[];
};
/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
export declare function estimate({ id, frame, intrinsics, fit }: EstimateRequest): Promise<{
    value: RawEstimate;
    transfer: Transferable[];
}>;
/**
 * @param {FindRequest} request
 * @returns {Promise<{ value: RawFinding, transfer: Transferable[] }>}
 */
export declare function find({ ids, estimated, frame, intrinsics, focal }: FindRequest): Promise<{
    value: RawFinding;
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
