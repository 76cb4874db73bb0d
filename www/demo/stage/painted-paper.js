// A paper painted once into a texture, for machines whose processor draws: there the papers' functions cost more than
// everything else on the page together.

import { createProgram, createTexture } from "../graphics/gl.js";
import { PAINTED_POWER, PAPERS_GLSL, PAPER_FUNCTIONS } from "../graphics/papers.js";
import { VERTEX_SHADER } from "./stage-shader.js";

/** @import { Paper } from "../graphics/papers.js" */

/** Pixels along the sheet's longer side. */
const LENGTH = 1024;

const fragmentShader = (/** @type {Paper} */ paper) => `#version 300 es
precision highp float;
precision highp int;
uniform vec2 u_size;               // pixels
uniform vec2 u_sheetMm;
uniform float u_seconds;
out vec4 o_color;
${PAPERS_GLSL}
void main() {
  vec2 mm = gl_FragCoord.xy / u_size * u_sheetMm;
  vec3 linear = ${PAPER_FUNCTIONS[paper]}(mm, u_sheetMm.x / u_size.x, u_sheetMm, u_seconds);
  o_color = vec4(pow(clamp(linear, 0.0, 1.0), vec3(${PAINTED_POWER})), 1.0);
}`;

export class PaintedPaper {
  #gl;
  /** Powers of linear light; mipmapped. */
  texture;
  #painted = "";

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.#gl = gl;
    this.texture = createTexture(gl, gl.LINEAR_MIPMAP_NEAREST);
  }

  /**
   * Paints the paper as it is at the moment `seconds`, unless it is there already.
   *
   * @param {Paper} paper
   * @param {readonly [number, number]} sheetMm
   * @param {number} seconds
   */
  paint(paper, sheetMm, seconds) {
    const wanted = `${paper} ${sheetMm.join(" ")}`;
    if (this.#painted === wanted) return;
    this.#painted = wanted;
    const gl = this.#gl;
    const scale = LENGTH / Math.max(...sheetMm);
    const size = /** @type {[number, number]} */ (sheetMm.map((side) => Math.max(1, Math.round(side * scale))));
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, ...size, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    gl.viewport(0, 0, ...size);
    gl.disable(gl.SCISSOR_TEST);
    const { program, uniform } = createProgram(gl, VERTEX_SHADER, fragmentShader(paper));
    gl.useProgram(program);
    gl.uniform2f(uniform("u_size"), ...size);
    gl.uniform2f(uniform("u_sheetMm"), ...sheetMm);
    gl.uniform1f(uniform("u_seconds"), seconds);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(framebuffer);
    gl.deleteProgram(program);
    gl.generateMipmap(gl.TEXTURE_2D);
  }
}
