import type { RawFlatPrint, RawMesh } from "../../pkg/deepsft_web.js";
import type { AddedTarget, EngineInfo, EstimateRequest, FindRequest, FlattenRequest, MeshRequest, PhotographRequest, RawEstimate, RawFinding, ScanRequest, StartRequest, TargetDescription, TargetRequest } from "./engine-worker.js";
import type { RawScan } from "../targets/scan.js";
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
 * @returns {Promise<{ value: AddedTarget, transfer: Transferable[] }>}
 */
export declare function addTarget({ id, source }: TargetRequest): Promise<{
    value: AddedTarget;
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
 * @param {PhotographRequest} request
 * @returns {Promise<{ value: number | undefined, transfer: Transferable[] }>}
 */
export declare function exifFocal({ file, width, height }: PhotographRequest): Promise<{
    value: number | undefined;
    transfer: Transferable[];
}>;
/**
 * @param {ScanRequest} request
 * @returns {Promise<{ value: RawScan, transfer: Transferable[] }>}
 */
export declare function readScan({ files, mmPerUnit }: ScanRequest): Promise<{
    value: RawScan;
    transfer: Transferable[];
}>;
/**
 * @param {EstimateRequest} request
 * @returns {Promise<{ value: RawEstimate, transfer: Transferable[] }>}
 */
export declare function estimate(request: EstimateRequest): Promise<{
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
 * @param {FlattenRequest} request
 * @returns {Promise<{ value: RawFlatPrint | null, transfer: Transferable[] }>}
 */
export declare function flatten({ id, frame, intrinsics, source, columns, unshaded }: FlattenRequest): Promise<{
    value: RawFlatPrint | null;
    transfer: Transferable[];
}>;
/**
 * @param {MeshRequest} request
 * @returns {Promise<{ value: RawMesh | null, transfer: Transferable[] }>}
 */
export declare function mesh({ id, width, focal, depth, registration, canonical }: MeshRequest): Promise<{
    value: RawMesh | null;
    transfer: Transferable[];
}>;
