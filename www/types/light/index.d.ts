export { LIGHT_FLOOR, LINEAR_OF_SRGB, MAX_LIGHT, TemplateLight, luminanceOf } from "./template-light.js";
export { MaskCovering, confirmed, seenFractions } from "./mask-covering.js";
export { PrintCovering } from "./print-covering.js";
export { SheetLight } from "./sheet-light.js";
export { VertexLight } from "./vertex-light.js";
