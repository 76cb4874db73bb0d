export { LIGHT_FLOOR, LINEAR_OF_SRGB, MAX_LIGHT, TemplateLight, luminanceOf } from "./template-light.js";
export { PrintCovering } from "./print-covering.js";
export { VertexLight } from "./vertex-light.js";
