// The tracked mesh on the stage: projected by the frame's camera, lit by the frame's light.

import { SMALL_LENGTH } from "./frame-picture.js";
import { createTexture, programVariants } from "../graphics/gl.js";
import { PAINTED_POWER } from "../graphics/papers.js";
import { BLUR_FRAGMENT_SHADER, DEPTH_FRAGMENT_SHADER, LIGHT_FRAGMENT_SHADER, MESH_VERTEX_SHADER, meshFragmentShader } from "./mesh-shader.js";
import { setProjection } from "./projection.js";
import { VERTEX_SHADER } from "./stage-shader.js";

/** @import { MeshTopology, SourcedCamera, SurfaceMesh } from "deepsft" */
/** @import { MeshOverlay } from "./mesh-shader.js" */
/** @import { PaperSource } from "../graphics/papers.js" */
/** @import { ObjectLayer } from "./object-layer.js" */
/** @import { VertexLight } from "deepsft/light" */

/** A vertex whose standard deviation is more than this fraction of its depth is loose, as in the rule for a shape that is determined. */
const LOOSE = 0.01;
/** Numbers per corner in the buffer that each frame fills: position, normal, confidence (2 less where it is loose) and fraction seen. */
const STRIDE = 8;

/**
 * @typedef {object} MeshView
 * @property {SourcedCamera} camera
 * @property {{ left: number, top: number, scale: number }} view of the image on the canvas, canvas pixels
 * @property {[number, number]} canvasSize
 * @property {MeshOverlay} overlay
 * @property {PaperSource} paper
 * @property {number} strength 0 to 1
 * @property {number} seconds
 * @property {readonly [number, number]} sheetMm
 * @property {readonly [number, number, number]} tint
 * @property {{ near: number, far: number, step: number }} depthScale mm
 * @property {number} lineWidth canvas pixels
 * @property {{ small: WebGLTexture } | { pixels: ImageData }} frame the camera's image, `SMALL_LENGTH` pixels long; pixels where the processor draws
 * @property {WebGLTexture} painted the paper, if it is painted
 * @property {WebGLTexture} heat
 * @property {ObjectLayer} object whose shadow falls on the sheet
 */

export class MeshLayer {
  #gl;
  #programs;
  #lightPrograms;
  #blurPrograms;
  #depthPrograms;
  #print;
  #vertexArray;
  #emptyArray;
  #corners;
  #coordinates;
  /**
   * Vertex of each corner of each face.
   *
   * @type {Uint32Array}
   */
  #faces = new Uint32Array();
  /** @type {Float32Array} */
  #filled = new Float32Array();
  /** @type {{ texture: WebGLTexture, framebuffer: WebGLFramebuffer }[]} the picture of the light, and the one it is blurred through */
  #light = [];
  #lightSize = [0, 0];
  #depthBuffer;
  /** Whether light can be kept in more than 8 bits. */
  #fine;
  #lightIsOld = false;
  #lights;
  /** @type {VertexLight | null} */
  #vertexLight = null;
  /** @type {{ vertices: Float32Array, seen: Float32Array }} of the newest mesh */
  #mesh = { vertices: new Float32Array(), seen: new Float32Array() };

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.#gl = gl;
    this.#programs = programVariants(gl, MESH_VERTEX_SHADER, meshFragmentShader);
    this.#lightPrograms = programVariants(gl, MESH_VERTEX_SHADER, () => LIGHT_FRAGMENT_SHADER);
    this.#blurPrograms = programVariants(gl, VERTEX_SHADER, () => BLUR_FRAGMENT_SHADER);
    this.#depthPrograms = programVariants(gl, MESH_VERTEX_SHADER, () => DEPTH_FRAGMENT_SHADER);
    this.#fine = gl.getExtension("EXT_color_buffer_float") !== null;
    this.#print = createTexture(gl, gl.LINEAR_MIPMAP_LINEAR);
    this.#emptyArray = gl.createVertexArray();
    this.#vertexArray = gl.createVertexArray();
    this.#corners = gl.createBuffer();
    this.#coordinates = gl.createBuffer();
    this.#lights = gl.createBuffer();
    this.#depthBuffer = gl.createRenderbuffer();
    gl.bindVertexArray(this.#vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    for (const [location, size, offset] of [
      [0, 3, 0],
      [1, 3, 3],
      [2, 2, 6],
    ]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 4 * STRIDE, 4 * offset);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#coordinates);
    for (const [location, size, offset] of [
      [3, 2, 0],
      [4, 1, 2],
    ]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 12, 4 * offset);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#lights);
    gl.enableVertexAttribArray(5);
    gl.vertexAttribPointer(5, 1, gl.FLOAT, false, 4, 0);
    gl.bindVertexArray(null);
  }

  /**
   * @param {{ texture: ImageData, mesh: MeshTopology }} template
   * @param {VertexLight} light on its vertices
   */
  setTemplate({ texture, mesh }, light) {
    const gl = this.#gl;
    const { faces, textureCoordinates } = mesh;
    this.#vertexLight = light;
    // What was set of another template's mesh is lit no more.
    this.#lightIsOld = false;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#lights);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(faces.length), gl.STATIC_DRAW);
    gl.bindTexture(gl.TEXTURE_2D, this.#print);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, texture);
    gl.generateMipmap(gl.TEXTURE_2D);
    const coordinates = new Float32Array(3 * faces.length);
    faces.forEach((vertex, corner) => {
      const uv = textureCoordinates.subarray(2 * vertex, 2 * vertex + 2);
      const face = faces.subarray(corner - (corner % 3), corner - (corner % 3) + 3);
      coordinates.set([...uv, diagonalOf(face, textureCoordinates)], 3 * corner);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#coordinates);
    gl.bufferData(gl.ARRAY_BUFFER, coordinates, gl.STATIC_DRAW);
    this.#faces = faces;
    // Until there is a mesh all corners lie in one point before the camera.
    this.#filled = Float32Array.from({ length: STRIDE * faces.length }, (_, i) => (i % STRIDE === 2 ? 1000 : 0));
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.bufferData(gl.ARRAY_BUFFER, this.#filled, gl.DYNAMIC_DRAW);
  }

  /**
   * @param {SurfaceMesh} mesh
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers, 0 to 1
   */
  setMesh({ vertices, normals, confidence, deviations }, seen) {
    const [gl, filled] = [this.#gl, this.#filled];
    this.#faces.forEach((vertex, corner) => {
      const at = STRIDE * corner;
      for (let k = 0; k < 3; k++) {
        filled[at + k] = vertices[3 * vertex + k];
        filled[at + 3 + k] = normals[3 * vertex + k];
      }
      filled[at + 6] = confidence[vertex] - (deviations[vertex] > LOOSE * vertices[3 * vertex + 2] ? 2 : 0);
      filled[at + 7] = seen[vertex];
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.bufferData(gl.ARRAY_BUFFER, filled, gl.DYNAMIC_DRAW);
    this.#mesh = { vertices, seen };
    this.#lightIsOld = true;
  }

  /**
   * Draws the mesh over what is on the canvas.
   *
   * @param {MeshView} mesh
   */
  draw(mesh) {
    const gl = this.#gl;
    if (mesh.overlay === "paper" && this.#lightIsOld) {
      if ("small" in mesh.frame) this.#drawLight(mesh.camera, mesh.frame.small);
      else this.#lightVertices(mesh.camera, mesh.frame.pixels);
      this.#lightIsOld = false;
    }
    gl.viewport(0, 0, ...mesh.canvasSize);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { program, uniform } = this.#programs(mesh.overlay, mesh.paper);
    gl.useProgram(program);
    this.#bind(uniform, { light: this.#light[0]?.texture ?? null, heat: mesh.heat, painted: mesh.painted });
    this.#project(uniform, mesh.camera, [mesh.view.left, mesh.view.top, mesh.view.scale], mesh.canvasSize);
    gl.uniform1f(uniform("u_strength"), mesh.strength);
    gl.uniform1f(uniform("u_seconds"), mesh.seconds);
    gl.uniform2f(uniform("u_sheetMm"), ...mesh.sheetMm);
    const power = mesh.paper === "painted" ? PAINTED_POWER : 1;
    gl.uniform3f(uniform("u_tint"), mesh.tint[0] ** power, mesh.tint[1] ** power, mesh.tint[2] ** power);
    gl.uniform3f(uniform("u_depthScale"), mesh.depthScale.near, mesh.depthScale.far, mesh.depthScale.step);
    gl.uniform1f(uniform("u_lineWidth"), mesh.lineWidth);
    if (mesh.overlay === "object") mesh.object.castShadow(uniform);
    // Nothing of it beyond the image.
    const { camera, view, canvasSize } = mesh;
    const [left, right] = [0, camera.width].map((x) => Math.round(view.left + x * view.scale));
    const [top, bottom] = [0, camera.height].map((y) => Math.round(view.top + y * view.scale));
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, canvasSize[1] - bottom, right - left, bottom - top);
    this.#drawMesh();
    if (mesh.overlay === "object") {
      this.#hide(mesh);
      mesh.object.draw(mesh);
    }
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.BLEND);
  }

  /**
   * Has the sheet hide what is drawn next and lies behind it, and all that is behind a hand which covers it.
   *
   * @param {MeshView} mesh
   */
  #hide({ camera, view, canvasSize }) {
    const gl = this.#gl;
    const { program, uniform } = this.#depthPrograms();
    gl.useProgram(program);
    setProjection(gl, uniform, camera, [view.left, view.top, view.scale], canvasSize);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.colorMask(false, false, false, false);
    // A little behind itself: what stands on it does not sink in.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 8);
    gl.uniform1i(uniform("u_coveredOnly"), 0);
    this.#drawMesh();
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.depthRange(0, 0);
    gl.uniform1i(uniform("u_coveredOnly"), 1);
    this.#drawMesh();
    gl.depthRange(0, 1);
    gl.colorMask(true, true, true, true);
  }

  /**
   * The light of each vertex, for machines whose processor draws: three passes of WebGL over a picture of the light take it longer than
   * all the rest of the sheet.
   *
   * @param {SourcedCamera} camera
   * @param {ImageData} frame
   */
  #lightVertices(camera, frame) {
    const { vertices, seen } = this.#mesh;
    const light = this.#vertexLight?.of(vertices, seen, camera, frame);
    if (!light) return;
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#lights);
    const corners = new Float32Array(this.#faces.length);
    for (let i = 0; i < corners.length; i++) corners[i] = light[this.#faces[i]] ** PAINTED_POWER;
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
  }

  /**
   * The picture of the light: luminance seen and printed, both low-passed.
   *
   * @param {SourcedCamera} camera
   * @param {WebGLTexture} frame
   */
  #drawLight(camera, frame) {
    const gl = this.#gl;
    const scale = SMALL_LENGTH / Math.max(camera.width, camera.height);
    const size = /** @type {[number, number]} */ ([Math.ceil(camera.width * scale), Math.ceil(camera.height * scale)]);
    this.#sizeLight(size);
    gl.viewport(0, 0, ...size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#light[0].framebuffer);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { program, uniform } = this.#lightPrograms();
    gl.useProgram(program);
    this.#bind(uniform, { frame, print: this.#print });
    this.#project(uniform, camera, [0, 0, scale], size);
    this.#drawMesh();

    gl.bindVertexArray(this.#emptyArray);
    for (const { from, to, step } of /** @type {const} */ ([
      { from: 0, to: 1, step: [1 / size[0], 0] },
      { from: 1, to: 0, step: [0, 1 / size[1]] },
    ])) {
      const { program, uniform } = this.#blurPrograms();
      gl.useProgram(program);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.#light[to].framebuffer);
      this.#bind(uniform, { light: this.#light[from].texture });
      gl.uniform2f(uniform("u_targetSize"), ...size);
      gl.uniform2f(uniform("u_step"), step[0], step[1]);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** @param {[number, number]} size */
  #sizeLight(size) {
    if (size[0] === this.#lightSize[0] && size[1] === this.#lightSize[1]) return;
    const gl = this.#gl;
    this.#lightSize = size;
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.#depthBuffer);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, ...size);
    for (const { texture, framebuffer } of this.#light) {
      gl.deleteTexture(texture);
      gl.deleteFramebuffer(framebuffer);
    }
    this.#light = [0, 1].map((i) => {
      const texture = createTexture(gl, gl.LINEAR);
      gl.texStorage2D(gl.TEXTURE_2D, 1, this.#fine ? gl.RGBA16F : gl.RGBA8, ...size);
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      if (i === 0) gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.#depthBuffer);
      return { texture, framebuffer };
    });
  }

  /**
   * @param {(name: string) => WebGLUniformLocation | null} uniform
   * @param {Record<string, WebGLTexture | null>} textures by sampler
   */
  #bind(uniform, textures) {
    const gl = this.#gl;
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(uniform(`u_${name}`), unit);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  /**
   * @param {(name: string) => WebGLUniformLocation | null} uniform
   * @param {SourcedCamera} camera
   * @param {[number, number, number]} view
   * @param {[number, number]} targetSize
   */
  #project(uniform, camera, view, targetSize) {
    const gl = this.#gl;
    setProjection(gl, uniform, camera, view, targetSize);
    gl.uniform2f(uniform("u_frameSize"), camera.width, camera.height);
  }

  #drawMesh() {
    const gl = this.#gl;
    gl.enable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.#vertexArray);
    gl.drawArrays(gl.TRIANGLES, 0, this.#faces.length);
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
  }
}

/**
 * The corner opposite the edge that only halves a cell of a grid: the one that runs along neither u nor v.
 *
 * @param {Uint32Array} face three vertices
 * @param {Float32Array} textureCoordinates
 * @returns {number} -1 when the face is not half a cell
 */
function diagonalOf(face, textureCoordinates) {
  const runs = (/** @type {number} */ corner, /** @type {0 | 1} */ axis) => {
    const [from, to] = [face[(corner + 1) % 3], face[(corner + 2) % 3]];
    return Math.abs(textureCoordinates[2 * from + axis] - textureCoordinates[2 * to + axis]) > 1e-6;
  };
  const diagonals = [0, 1, 2].filter((corner) => runs(corner, 0) && runs(corner, 1));
  return diagonals.length === 1 ? diagonals[0] : -1;
}
