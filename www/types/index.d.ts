export { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH } from "./camera/canonical.js";
export { canonicalFromImage, canonicalSize, imageFromCanonical, verticesInImage } from "./camera/canonical.js";
export { visibleRegion } from "./camera/visible-region.js";
export { LENS_GLSL, lensUniform } from "./camera/lens.js";
export { CameraStream, listCameras, openCamera } from "./camera/camera-stream.js";
export { DeepSft } from "./deepsft.js";
export { DeepSftError } from "./error.js";
export { Estimate, EstimateMap } from "./results/estimate.js";
export { PAPER_CAMERAS, TYPICAL_FOCAL_FRACTION, estimatedCamera } from "./camera/intrinsics.js";
export { isPrintOutline, printAspect, rectifyPicture } from "./targets/rectify.js";
export { Session } from "./tracking/session.js";
export { Recording, pictureOf, recordingCanvas, recordingKind, shareFile } from "./record/recording.js";
export { measureSheet } from "./results/measures.js";
export { SurfaceMesh } from "./results/surface-mesh.js";
export { whyUnreadable } from "./frames/image-input.js";
export { Scan } from "./targets/scan.js";
export { SurfacePose } from "./results/surface-pose.js";
export { Target } from "./targets/target.js";
export { TrackedFrame, TrackedTarget } from "./results/tracked-frame.js";
export type LoadProgress = import("./engine/bundle.js").LoadProgress;
export type ListedCamera = import("./camera/camera-stream.js").ListedCamera;
export type Facing = import("./camera/request.js").Facing;
export type OpenCameraOptions = import("./camera/request.js").OpenCameraOptions;
export type EstimateOptions = import("./deepsft.js").EstimateOptions;
export type FlatPrint = import("./deepsft.js").FlatPrint;
export type FlattenOptions = import("./deepsft.js").FlattenOptions;
export type LoadOptions = import("./engine/bundle.js").LoadOptions;
export type PictureOptions = import("./targets/target-source.js").PictureOptions;
export type FollowOptions = import("./deepsft.js").FollowOptions;
export type EngineInfo = import("./engine/engine-worker.js").EngineInfo;
export type MeshTopology = import("./engine/engine-worker.js").MeshTopology;
export type PictureGrade = import("./engine/engine-worker.js").PictureGrade;
export type DeepSftErrorCode = import("./error.js").DeepSftErrorCode;
export type EstimateTimes = import("./results/estimate.js").EstimateTimes;
export type ImageInput = import("./frames/image-input.js").ImageInput;
export type PrintCorners = import("./targets/rectify.js").PrintCorners;
export type Camera = import("./camera/intrinsics.js").Camera;
export type CameraOption = import("./camera/intrinsics.js").CameraOption;
export type CameraSource = import("./camera/intrinsics.js").CameraSource;
export type SourcedCamera = import("./camera/intrinsics.js").SourcedCamera;
export type MeshMethod = import("./results/surface-mesh.js").MeshMethod;
export type TrackedTimes = import("./results/tracked-frame.js").TrackedTimes;
export type ScanInput = import("./targets/scan.js").ScanInput;
export type TargetKind = import("./targets/target.js").TargetKind;
export type TemplateInput = import("./targets/target-source.js").TemplateInput;
export type OwnFrame = import("./frames/own-frames.js").OwnFrame;
export type StallReason = import("./frames/video-frames.js").StallReason;
export type FoundFocal = import("./tracking/session.js").FoundFocal;
export type FrameSource = import("./tracking/session.js").FrameSource;
export type SessionEvents = import("./tracking/session.js").SessionEvents;
export type Smoothing = import("./tracking/tracker-host.js").Smoothing;
/** @typedef {import("./engine/bundle.js").LoadProgress} LoadProgress */
/** @typedef {import("./camera/camera-stream.js").ListedCamera} ListedCamera */
/** @typedef {import("./camera/request.js").Facing} Facing */
/** @typedef {import("./camera/request.js").OpenCameraOptions} OpenCameraOptions */
/** @typedef {import("./deepsft.js").EstimateOptions} EstimateOptions */
/** @typedef {import("./deepsft.js").FlatPrint} FlatPrint */
/** @typedef {import("./deepsft.js").FlattenOptions} FlattenOptions */
/** @typedef {import("./engine/bundle.js").LoadOptions} LoadOptions */
/** @typedef {import("./targets/target-source.js").PictureOptions} PictureOptions */
/** @typedef {import("./deepsft.js").FollowOptions} FollowOptions */
/** @typedef {import("./engine/engine-worker.js").EngineInfo} EngineInfo */
/** @typedef {import("./engine/engine-worker.js").MeshTopology} MeshTopology */
/** @typedef {import("./engine/engine-worker.js").PictureGrade} PictureGrade */
/** @typedef {import("./error.js").DeepSftErrorCode} DeepSftErrorCode */
/** @typedef {import("./results/estimate.js").EstimateTimes} EstimateTimes */
/** @typedef {import("./frames/image-input.js").ImageInput} ImageInput */
/** @typedef {import("./targets/rectify.js").PrintCorners} PrintCorners */
/** @typedef {import("./camera/intrinsics.js").Camera} Camera */
/** @typedef {import("./camera/intrinsics.js").CameraOption} CameraOption */
/** @typedef {import("./camera/intrinsics.js").CameraSource} CameraSource */
/** @typedef {import("./camera/intrinsics.js").SourcedCamera} SourcedCamera */
/** @typedef {import("./results/surface-mesh.js").MeshMethod} MeshMethod */
/** @typedef {import("./results/tracked-frame.js").TrackedTimes} TrackedTimes */
/** @typedef {import("./targets/scan.js").ScanInput} ScanInput */
/** @typedef {import("./targets/target.js").TargetKind} TargetKind */
/** @typedef {import("./targets/target-source.js").TemplateInput} TemplateInput */
/** @typedef {import("./frames/own-frames.js").OwnFrame} OwnFrame */
/** @typedef {import("./frames/video-frames.js").StallReason} StallReason */
/** @typedef {import("./tracking/session.js").FoundFocal} FoundFocal */
/** @typedef {import("./tracking/session.js").FrameSource} FrameSource */
/** @typedef {import("./tracking/session.js").SessionEvents} SessionEvents */
/** @typedef {import("./tracking/tracker-host.js").Smoothing} Smoothing */
