export { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH, canonicalFromImage, imageFromCanonical, visibleRegion, } from "./canonical.js";
export { CameraStream, listCameras, openCamera } from "./camera.js";
export { DeepSft } from "./deepsft.js";
export { DeepSftError } from "./error.js";
export { Estimate, EstimateMap } from "./estimate.js";
export { FocalCalibration } from "./focal-calibration.js";
export { TYPICAL_FOCAL_SHARE, estimatedCamera } from "./intrinsics.js";
export { Tracking } from "./tracking.js";
export type LoadProgress = import("./bundle.js").LoadProgress;
export type OpenCameraOptions = import("./camera.js").OpenCameraOptions;
export type CameraOption = import("./deepsft.js").CameraOption;
export type EstimateOptions = import("./deepsft.js").EstimateOptions;
export type LoadOptions = import("./deepsft.js").LoadOptions;
export type EngineInfo = import("./engine.js").EngineInfo;
export type DeepSftErrorCode = import("./error.js").DeepSftErrorCode;
export type EstimateTimes = import("./estimate.js").EstimateTimes;
export type ImageInput = import("./image-input.js").ImageInput;
export type Camera = import("./intrinsics.js").Camera;
export type CameraSource = import("./intrinsics.js").CameraSource;
export type SourcedCamera = import("./intrinsics.js").SourcedCamera;
/** @typedef {import("./bundle.js").LoadProgress} LoadProgress */
/** @typedef {import("./camera.js").OpenCameraOptions} OpenCameraOptions */
/** @typedef {import("./deepsft.js").CameraOption} CameraOption */
/** @typedef {import("./deepsft.js").EstimateOptions} EstimateOptions */
/** @typedef {import("./deepsft.js").LoadOptions} LoadOptions */
/** @typedef {import("./engine.js").EngineInfo} EngineInfo */
/** @typedef {import("./error.js").DeepSftErrorCode} DeepSftErrorCode */
/** @typedef {import("./estimate.js").EstimateTimes} EstimateTimes */
/** @typedef {import("./image-input.js").ImageInput} ImageInput */
/** @typedef {import("./intrinsics.js").Camera} Camera */
/** @typedef {import("./intrinsics.js").CameraSource} CameraSource */
/** @typedef {import("./intrinsics.js").SourcedCamera} SourcedCamera */
