// The little of WebGL 2 that the page's two pictures share.

/** Thrown where the browser offers no WebGL 2, or none any more. */
export class NoWebGl extends Error {}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {WebGLContextAttributes} attributes
 * @returns {WebGL2RenderingContext}
 * @throws {NoWebGl}
 */
export function webGlOf(canvas, attributes) {
  const gl = canvas.getContext("webgl2", attributes);
  if (!gl) throw new NoWebGl("This browser offers no WebGL 2.");
  return gl;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertexShader
 * @param {string} fragmentShader
 * @returns {{ program: WebGLProgram, uniform: (name: string) => WebGLUniformLocation | null }}
 */
export function createProgram(gl, vertexShader, fragmentShader) {
  const program = gl.createProgram();
  for (const [kind, source] of /** @type {const} */ ([
    [gl.VERTEX_SHADER, vertexShader],
    [gl.FRAGMENT_SHADER, fragmentShader],
  ])) {
    const shader = gl.createShader(kind);
    if (!shader) throw new Error("The graphics context was lost.");
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
      throw new Error(`A shader does not compile: ${gl.getShaderInfoLog(shader)}`);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS))
    throw new Error(`The shaders do not link: ${gl.getProgramInfoLog(program)}`);
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const locations = new Map();
  const uniform = (/** @type {string} */ name) => {
    if (!locations.has(name)) locations.set(name, gl.getUniformLocation(program, name));
    return locations.get(name) ?? null;
  };
  return { program, uniform };
}

/** @typedef {ReturnType<typeof createProgram>} Program */

/**
 * Programs that differ in what is drawn, each made when it is first drawn. A shader that chose by itself would be as slow
 * as all choices together where the processor draws, and on some GPUs.
 *
 * @template {string[]} Choice
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertexShader
 * @param {(...choice: Choice) => string} fragmentShader
 * @returns {(...choice: Choice) => Program}
 */
export function programVariants(gl, vertexShader, fragmentShader) {
  /** @type {Map<string, Program>} */
  const programs = new Map();
  return (...choice) => {
    const key = choice.join(" ");
    const program = programs.get(key) ?? createProgram(gl, vertexShader, fragmentShader(...choice));
    programs.set(key, program);
    return program;
  };
}

/**
 * A texture that does not repeat.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {number} filter for minification; magnification is the same without mipmaps
 * @returns {WebGLTexture}
 */
export function createTexture(gl, filter) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter === gl.NEAREST ? gl.NEAREST : gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}

/**
 * Whether the processor does the drawing, going by the renderer's name, where the browser tells it.
 *
 * @param {WebGL2RenderingContext} gl
 */
export function drawsInSoftware(gl) {
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const renderer = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return /swiftshader|llvmpipe|softpipe|basic render|software/i.test(renderer);
}
