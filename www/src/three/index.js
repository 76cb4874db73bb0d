// `deepsft/three`: tracked surfaces in scenes of three.js. Units are millimetres.

export { Anchor } from "./anchor.js";
export { FrameBackground } from "./frame-background.js";
export { FrameCamera } from "./frame-camera.js";
export { PaperLight } from "./paper-light.js";
export { Sheet } from "./sheet.js";
export { SurfaceGeometry, turnedFrame } from "./surface-geometry.js";

/** @typedef {import("./anchor.js").AnchorOptions} AnchorOptions */
/** @typedef {import("./frame-camera.js").FrameFit} FrameFit */
/** @typedef {import("./sheet.js").SheetOptions} SheetOptions */
