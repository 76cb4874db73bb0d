// The camera's frame on the GPU: as it is, small, and far out of focus.

import { createTexture, programVariants } from "../graphics/gl.js";
import { VERTEX_SHADER } from "./stage-shader.js";

/** Pixels of the small picture along its long side: folds of a sheet are wider than one, its print is narrower. */
export const SMALL_LENGTH = 160;
const BLURRED_LENGTH = 48;
/** Frame pixels a canvas pixel from which one bilinear sample of the frame skips some of its pixels. */
const MAX_MINIFICATION = 2;

/** The mean of the frame's pixels within a small one: bilinear samples, each the mean of four pixels. */
const SMALL_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_picture;
uniform vec2 u_size;               // pixels
uniform int u_samples;             // along each side
out vec4 o_color;
void main() {
  vec3 sum = vec3(0.0);
  vec2 corner = gl_FragCoord.xy - 0.5;
  float n = float(u_samples);
  for (int j = 0; j < u_samples; j++)
    for (int i = 0; i < u_samples; i++)
      sum += textureLod(u_picture, (corner + (vec2(i, j) + 0.5) / n) / u_size, 0.0).rgb;
  o_color = vec4(sum / (n * n), 1.0);
}`;

const BLURRED_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_picture;
uniform vec2 u_size;               // pixels
out vec4 o_color;
void main() {
  vec3 sum = vec3(0.0);
  for (int j = -4; j <= 4; j++)
    for (int i = -4; i <= 4; i++) sum += texture(u_picture, gl_FragCoord.xy / u_size + vec2(i, j) * 0.018).rgb;
  o_color = vec4(sum / 81.0, 1.0);
}`;

const REDUCTIONS = { small: SMALL_FRAGMENT_SHADER, blurred: BLURRED_FRAGMENT_SHADER };

export class FramePicture {
  #gl;
  #programs;
  #framebuffer;
  /** sRGB; mipmapped where it is drawn much smaller. */
  texture;
  /** At most `SMALL_LENGTH` pixels long, without aliases. */
  small;
  /** The whole frame far out of focus. */
  blurred;
  #size = [0, 0];
  /** @type {{ small: [number, number], blurred: [number, number] }} */
  #sizes = { small: [1, 1], blurred: [1, 1] };
  /** What has been made of the newest frame. @type {Set<"mipmaps" | "small" | "blurred">} */
  #made = new Set();

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.#gl = gl;
    this.#programs = programVariants(gl, VERTEX_SHADER, (/** @type {"small" | "blurred"} */ to) => REDUCTIONS[to]);
    this.#framebuffer = gl.createFramebuffer();
    this.texture = createTexture(gl, gl.LINEAR);
    this.small = createTexture(gl, gl.LINEAR);
    this.blurred = createTexture(gl, gl.LINEAR);
  }

  /** @param {ImageBitmap} frame may be closed afterwards */
  upload(frame) {
    const gl = this.#gl;
    const { width, height } = frame;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, frame);
    this.#made.clear();
    if (width === this.#size[0] && height === this.#size[1]) return;
    this.#size = [width, height];
    const within = (/** @type {number} */ length) => {
      const scale = Math.min(1, length / Math.max(width, height));
      return /** @type {[number, number]} */ ([Math.ceil(width * scale), Math.ceil(height * scale)]);
    };
    this.#sizes = { small: within(SMALL_LENGTH), blurred: within(BLURRED_LENGTH) };
    for (const name of /** @type {const} */ (["small", "blurred"])) {
      gl.bindTexture(gl.TEXTURE_2D, this[name]);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, ...this.#sizes[name], 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    }
  }

  /**
   * Makes `texture` ready to be drawn.
   *
   * @param {number} scale canvas pixels per frame pixel that it is to be drawn with
   */
  prepare(scale) {
    const gl = this.#gl;
    const shrunk = scale * MAX_MINIFICATION < 1;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, shrunk ? gl.LINEAR_MIPMAP_LINEAR : gl.LINEAR);
    if (shrunk) this.#once("mipmaps", () => gl.generateMipmap(gl.TEXTURE_2D));
  }

  /** Makes `small`, which the light on a mesh is taken from. */
  prepareSmall() {
    const samples = Math.max(1, Math.ceil(this.#size[0] / this.#sizes.small[0] / MAX_MINIFICATION));
    this.#once("small", () => this.#reduce("small", this.texture, samples));
  }

  /** The pixels of `small`: the GPU is waited for. @returns {ImageData} its first row on top */
  get pixels() {
    this.prepareSmall();
    const gl = this.#gl;
    const [width, height] = this.#sizes.small;
    const pixels = new ImageData(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.small, 0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels.data);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixels;
  }

  /** Makes `blurred`, which strips beside the frame are drawn from. */
  prepareBlurred() {
    this.prepareSmall();
    this.#once("blurred", () => this.#reduce("blurred", this.small));
  }

  /**
   * @param {"mipmaps" | "small" | "blurred"} name
   * @param {() => void} make
   */
  #once(name, make) {
    if (!this.#made.has(name)) make();
    this.#made.add(name);
  }

  /**
   * @param {"small" | "blurred"} to
   * @param {WebGLTexture} from
   * @param {number} [samples]
   */
  #reduce(to, from, samples) {
    const gl = this.#gl;
    const size = this.#sizes[to];
    const { program, uniform } = this.#programs(to);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this[to], 0);
    gl.viewport(0, 0, ...size);
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, from);
    gl.uniform1i(uniform("u_picture"), 0);
    gl.uniform2f(uniform("u_size"), ...size);
    if (samples !== undefined) gl.uniform1i(uniform("u_samples"), samples);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }
}
