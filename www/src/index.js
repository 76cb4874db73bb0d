// The npm package `deepsft`: shape from template in the browser.

export {
  CANONICAL_FOCAL,
  CANONICAL_HEIGHT,
  CANONICAL_WIDTH,
  canonicalFromImage,
  imageFromCanonical,
  visibleRegion,
} from "./canonical.js";
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
