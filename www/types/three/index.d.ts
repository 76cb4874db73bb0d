export { Anchor } from "./anchor.js";
export { FrameBackground } from "./frame-background.js";
export { FrameCamera } from "./frame-camera.js";
export { PaperLight } from "./paper-light.js";
export { Sheet } from "./sheet.js";
export { SurfaceGeometry, turnedFrame } from "./surface-geometry.js";
export type AnchorOptions = import("./anchor.js").AnchorOptions;
export type FrameFit = import("./frame-camera.js").FrameFit;
export type SheetOptions = import("./sheet.js").SheetOptions;
/** @typedef {import("./anchor.js").AnchorOptions} AnchorOptions */
/** @typedef {import("./frame-camera.js").FrameFit} FrameFit */
/** @typedef {import("./sheet.js").SheetOptions} SheetOptions */
