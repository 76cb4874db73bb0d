export { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH, canonicalFromImage, imageFromCanonical, visibleRegion, } from "./canonical.js";
export { CameraStream, listCameras, openCamera } from "./camera.js";
export { DeepSft } from "./deepsft.js";
export { DeepSftError } from "./error.js";
export { Estimate, EstimateMap } from "./estimate.js";
export { FocalCalibration } from "./focal-calibration.js";
export { TYPICAL_FOCAL_SHARE, estimatedCamera } from "./intrinsics.js";
export { MeshTracking } from "./mesh-tracking.js";
export { SurfaceMesh } from "./surface-mesh.js";
export { TrackedFrame } from "./tracked-frame.js";
export { Tracking } from "./tracking.js";
export type LoadProgress = import("./bundle.js").LoadProgress;
export type OpenCameraOptions = import("./camera.js").OpenCameraOptions;
export type EstimateOptions = import("./deepsft.js").EstimateOptions;
export type LoadOptions = import("./deepsft.js").LoadOptions;
export type TrackMeshOptions = import("./deepsft.js").TrackMeshOptions;
export type EngineInfo = import("./engine.js").EngineInfo;
export type MeshTopology = import("./engine.js").MeshTopology;
export type DeepSftErrorCode = import("./error.js").DeepSftErrorCode;
export type EstimateTimes = import("./estimate.js").EstimateTimes;
export type ImageInput = import("./image-input.js").ImageInput;
export type Camera = import("./intrinsics.js").Camera;
export type CameraOption = import("./intrinsics.js").CameraOption;
export type CameraSource = import("./intrinsics.js").CameraSource;
export type SourcedCamera = import("./intrinsics.js").SourcedCamera;
export type TrackedTimes = import("./tracked-frame.js").TrackedTimes;
export type Smoothing = import("./tracker.js").Smoothing;
/** @typedef {import("./bundle.js").LoadProgress} LoadProgress */
/** @typedef {import("./camera.js").OpenCameraOptions} OpenCameraOptions */
/** @typedef {import("./deepsft.js").EstimateOptions} EstimateOptions */
/** @typedef {import("./deepsft.js").LoadOptions} LoadOptions */
/** @typedef {import("./deepsft.js").TrackMeshOptions} TrackMeshOptions */
/** @typedef {import("./engine.js").EngineInfo} EngineInfo */
/** @typedef {import("./engine.js").MeshTopology} MeshTopology */
/** @typedef {import("./error.js").DeepSftErrorCode} DeepSftErrorCode */
/** @typedef {import("./estimate.js").EstimateTimes} EstimateTimes */
/** @typedef {import("./image-input.js").ImageInput} ImageInput */
/** @typedef {import("./intrinsics.js").Camera} Camera */
/** @typedef {import("./intrinsics.js").CameraOption} CameraOption */
/** @typedef {import("./intrinsics.js").CameraSource} CameraSource */
/** @typedef {import("./intrinsics.js").SourcedCamera} SourcedCamera */
/** @typedef {import("./tracked-frame.js").TrackedTimes} TrackedTimes */
/** @typedef {import("./tracker.js").Smoothing} Smoothing */
