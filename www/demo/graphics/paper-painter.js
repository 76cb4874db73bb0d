// A paper painted into a texture, which is printed on the sheet.

import { Camera, LinearMipmapLinearFilter, LinearMipmapNearestFilter, Mesh, PlaneGeometry, SRGBColorSpace, ShaderMaterial, Vector2, WebGLRenderTarget } from "three";
import { PAPERS_GLSL } from "./papers.js";

/** @import { WebGLRenderer } from "three" */
/** @import { Paper } from "./papers.js" */

/** Pixels along the sheet's longer side. */
const LENGTH = 1024;
const ANISOTROPY = 8;

const VERTEX_SHADER = "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }";

const fragmentShader = (/** @type {Paper} */ paper) => `
uniform vec2 u_size;               // pixels
uniform vec2 u_sheetMm;
uniform float u_seconds;
${PAPERS_GLSL}
void main() {
  vec2 mm = vec2(gl_FragCoord.x, u_size.y - gl_FragCoord.y) / u_size * u_sheetMm;
  gl_FragColor = vec4(clamp(${paper}Paper(mm, u_sheetMm.x / u_size.x, u_sheetMm, u_seconds), 0.0, 1.0), 1.0);
}`;

export class PaperPainter {
  #renderer;
  #target;
  #uniforms;
  #camera = new Camera();
  #plane = new PlaneGeometry(2, 2);
  /** @type {Map<Paper, Mesh>} */
  #papers = new Map();

  /**
   * @param {WebGLRenderer} renderer
   * @param {{ widthMm: number, heightMm: number }} sheet
   * @param {boolean} software whether the processor draws, for which fine filtering is dear
   */
  constructor(renderer, { widthMm, heightMm }, software) {
    const scale = LENGTH / Math.max(widthMm, heightMm);
    const [width, height] = [widthMm, heightMm].map((side) => Math.max(1, Math.round(side * scale)));
    const filtering = { generateMipmaps: true, minFilter: software ? LinearMipmapNearestFilter : LinearMipmapLinearFilter, anisotropy: software ? 1 : ANISOTROPY };
    this.#renderer = renderer;
    this.#target = new WebGLRenderTarget(width, height, { ...filtering, colorSpace: SRGBColorSpace, depthBuffer: false });
    /** What is printed. */
    this.texture = this.#target.texture;
    this.#uniforms = { u_size: { value: new Vector2(width, height) }, u_sheetMm: { value: new Vector2(widthMm, heightMm) }, u_seconds: { value: 0 } };
  }

  /**
   * Paints a paper as it is at a moment.
   *
   * @param {Paper} paper
   * @param {number} seconds
   */
  paint(paper, seconds) {
    let mesh = this.#papers.get(paper);
    if (!mesh) {
      const material = new ShaderMaterial({ vertexShader: VERTEX_SHADER, fragmentShader: fragmentShader(paper), uniforms: this.#uniforms, depthTest: false });
      mesh = new Mesh(this.#plane, material);
      mesh.frustumCulled = false;
      this.#papers.set(paper, mesh);
    }
    this.#uniforms.u_seconds.value = seconds;
    this.#renderer.setRenderTarget(this.#target);
    this.#renderer.render(mesh, this.#camera);
    this.#renderer.setRenderTarget(null);
  }

  dispose() {
    this.#target.dispose();
    this.#plane.dispose();
    for (const { material } of this.#papers.values()) /** @type {ShaderMaterial} */ (material).dispose();
  }
}
