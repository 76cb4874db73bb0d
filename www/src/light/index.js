// `deepsft/light`: what a drawing on a tracked sheet needs to look as if it lay in the same room. The demo page and `deepsft/three` use it.

export { LIGHT_FLOOR, LINEAR_OF_SRGB, MAX_LIGHT, TemplateLight, luminanceOf } from "./template-light.js";
export { MaskCovering, confirmed, seenFractions } from "./mask-covering.js";
export { PrintCovering } from "./print-covering.js";
export { SheetLight } from "./sheet-light.js";
export { VertexLight } from "./vertex-light.js";
