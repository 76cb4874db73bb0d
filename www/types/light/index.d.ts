export { FLOOR, LINEAR, MOST, TemplateLight, luminanceOf } from "./template-light.js";
export { PrintCovering } from "./print-covering.js";
export { VertexLight } from "./vertex-light.js";
