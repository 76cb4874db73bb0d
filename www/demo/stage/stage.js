// The stage: the canvas on which frame and overlay are drawn.

import { CANONICAL_FOCAL, CANONICAL_HEIGHT, CANONICAL_WIDTH } from "deepsft";
import { FramePicture } from "./frame-picture.js";
import { createProgram, createTexture, drawsInSoftware, programVariants } from "../graphics/gl.js";
import { heatRow } from "../graphics/heat.js";
import { MeshLayer } from "./mesh-layer.js";
import { MESH_OVERLAYS } from "./mesh-shader.js";
import { PaintedPaper } from "./painted-paper.js";
import { SHADING_HEIGHT, SHADING_WIDTH } from "./shading.js";
import { softMask } from "./soft-mask.js";
import { BACKDROP_FRAGMENT_SHADER, MAP_OVERLAYS, VERTEX_SHADER, stageFragmentShader } from "./stage-shader.js";
import { viewOf } from "./view.js";

/** @import { Estimate, SourcedCamera, SurfaceMesh, Target } from "deepsft" */
/** @import { Program } from "../graphics/gl.js" */
/** @import { MeshOverlay } from "./mesh-shader.js" */
/** @import { MapOverlay } from "./stage-shader.js" */
/** @import { Paper } from "../graphics/papers.js" */

/** @typedef {"paper" | "shaded" | "mesh" | "depth" | "mask" | "plain"} Overlay */

/** Canvas pixels per CSS pixel, at most: more cannot be seen and costs time. */
const MOST_DENSITY = 2;
/** Canvas pixels, at most, where the processor draws. */
const MOST_SOFTWARE_PIXELS = 330_000;
/** Seconds in which an overlay appears after the sheet was found. */
const APPEAR_SECONDS = 0.25;
/** Width of the wireframe's lines, CSS pixels. */
const LINE_WIDTH = 1.1;
/** Texture units, in the order of the shader's samplers. */
const SAMPLERS = /** @type {const} */ (["frame", "depth", "registration", "coverage", "shading", "heat", "painted"]);
/** The moment at which papers look well that do not move. */
const STILL_SECONDS = 5.2;

export class Stage {
  #canvas;
  #gl;
  #programs;
  #backdropProgram;
  #frame;
  #paintedPaper;
  #textures;
  #meshLayer;
  /** Whether there is a mesh that belongs to the frame. */
  #hasMesh = false;
  /** @type {SourcedCamera | null} */
  #camera = null;
  #foundSince = Infinity;
  #covered = { top: 0, bottom: 0 };
  /** @type {[number, number]} */
  #sheetMm = [1, 1];
  /**
   * Colour of the light, of mean luminance 1.
   *
   * @type {readonly [number, number, number]}
   */
  tint = [1, 1, 1];
  /** Near and far end and contour step of the depth scale, mm. */
  depthScale = { near: 0, far: 1, step: 1 };
  /** @type {Overlay} */
  overlay = "paper";
  /** Canvas pixels per CSS pixel where drawing is slow; 1 leaves it to the screen. */
  quality = 1;
  /** Whether `draw` is called all the time, so that an overlay can appear bit by bit. */
  animated = false;
  /** Whether the processor does the drawing. */
  software;
  /** @type {Paper} */
  paper = "aurora";

  /**
   * @param {HTMLCanvasElement} canvas
   * @throws {Error} when the browser has no WebGL 2
   */
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("This browser offers no WebGL 2, which the page draws with.");
    this.#canvas = canvas;
    this.#gl = gl;
    this.software = drawsInSoftware(gl);
    this.#programs = programVariants(gl, VERTEX_SHADER, stageFragmentShader);
    this.#backdropProgram = createProgram(gl, VERTEX_SHADER, BACKDROP_FRAGMENT_SHADER);
    this.#meshLayer = new MeshLayer(gl);
    this.#frame = new FramePicture(gl);
    this.#paintedPaper = new PaintedPaper(gl);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const texture = (/** @type {number} */ filter) => createTexture(gl, filter);
    this.#textures = {
      frame: this.#frame.texture,
      blurred: this.#frame.blurred,
      painted: this.#paintedPaper.texture,
      depth: texture(gl.NEAREST),
      registration: texture(gl.NEAREST),
      coverage: texture(gl.LINEAR),
      shading: texture(gl.LINEAR),
      heat: texture(gl.LINEAR),
    };
    const heat = heatRow(256);
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.heat);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, heat);
  }

  /** @param {Target} template */
  setTemplate(template) {
    this.#sheetMm = [template.widthMm, template.heightMm];
    this.#meshLayer.setTemplate(template);
  }

  /**
   * What of the stage is covered by controls, CSS pixels.
   *
   * @param {number} top
   * @param {number} bottom
   */
  setCovered(top, bottom) {
    this.#covered = { top, bottom };
  }

  /**
   * Takes over a frame with its maps; the estimate may be closed afterwards.
   *
   * @param {Estimate} estimate
   * @param {Float32Array | null} shading null when nothing was found
   */
  showMaps(estimate, shading) {
    const gl = this.#gl;
    this.#showFrame(estimate, shading !== null);
    this.#hasMesh = false;
    if (!shading) return;
    const [w, h] = [CANONICAL_WIDTH, CANONICAL_HEIGHT];
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.depth);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, w, h, 0, gl.RED, gl.FLOAT, estimate.depth.values());
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.registration);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG32F, w, h, 0, gl.RG, gl.FLOAT, estimate.registration.values());
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.coverage);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, w, h, 0, gl.RED, gl.UNSIGNED_BYTE, softMask(estimate.mask.values()));
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.shading);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, SHADING_WIDTH, SHADING_HEIGHT, 0, gl.RED, gl.FLOAT, shading);
  }

  /**
   * Takes over a frame with the mesh in it; the frame may be closed afterwards.
   *
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} tracked
   * @param {SurfaceMesh | null} mesh null when nothing is followed
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
   */
  showMesh(tracked, mesh, seen) {
    this.#showFrame(tracked, mesh !== null);
    this.addMesh(mesh, seen);
  }

  /**
   * Takes over the mesh of the frame that is shown already.
   *
   * @param {SurfaceMesh | null} mesh
   * @param {Float32Array} seen
   */
  addMesh(mesh, seen) {
    this.#hasMesh = mesh !== null;
    if (mesh) this.#meshLayer.setMesh(mesh, seen);
  }

  /**
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} shown
   * @param {boolean} found
   */
  #showFrame({ frame, camera }, found) {
    this.#camera = camera;
    if (frame) this.#frame.upload(frame);
    if (!found) this.#foundSince = Infinity;
    else if (this.#foundSince === Infinity)
      this.#foundSince = performance.now() - (this.animated ? 0 : 1000 * APPEAR_SECONDS);
  }

  /** Whether there is a frame to draw. */
  get busy() {
    return this.#camera !== null;
  }

  /** Forgets the frame. */
  clear() {
    this.#camera = null;
    this.#hasMesh = false;
    this.#foundSince = Infinity;
  }

  /**
   * Draws the newest frame.
   *
   * @param {number} seconds for papers that move
   */
  draw(seconds) {
    const [gl, canvas, camera] = [this.#gl, this.#canvas, this.#camera];
    const density = this.#density();
    const [width, height] = [Math.round(canvas.clientWidth * density), Math.round(canvas.clientHeight * density)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    if (!camera) {
      gl.clearColor(0.055, 0.063, 0.075, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      return;
    }
    const { scale, left, top, region } = viewOf(
      { width, height, top: this.#covered.top * density, bottom: this.#covered.bottom * density },
      camera,
    );
    const meshOverlay = this.#hasMesh && this.overlay in MESH_OVERLAYS;
    const fromMaps = !meshOverlay && this.overlay in MAP_OVERLAYS;
    const mapOverlay = fromMaps ? /** @type {MapOverlay} */ (this.overlay) : "plain";
    const age = (performance.now() - this.#foundSince) / 1000;
    const strength = Math.min(1, Math.max(0, age / APPEAR_SECONDS));
    this.#frame.prepare(scale);
    const paper = this.software ? "painted" : this.paper;
    if (paper === "painted" && this.overlay === "paper") this.#paintedPaper.paint(this.paper, this.#sheetMm, STILL_SECONDS);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    this.#drawBackdrop([width, height], camera, { left, top, scale });
    const { program, uniform } = this.#programs(mapOverlay, paper, isWhole(region, camera) ? "whole" : "part");
    gl.useProgram(program);
    this.#bind(uniform, SAMPLERS);
    gl.uniform2f(uniform("u_canvasSize"), width, height);
    gl.uniform3f(uniform("u_view"), left, top, scale);
    gl.uniform2f(uniform("u_frameSize"), camera.width, camera.height);
    gl.uniform4f(uniform("u_camera"), camera.fx, camera.fy, camera.cx, camera.cy);
    gl.uniform1fv(uniform("u_distortion"), camera.distortion);
    gl.uniform4f(uniform("u_region"), region.left, region.top, region.right, region.bottom);
    gl.uniform3f(uniform("u_canonical"), CANONICAL_WIDTH, CANONICAL_HEIGHT, CANONICAL_FOCAL);
    gl.uniform1f(uniform("u_strength"), strength);
    gl.uniform1f(uniform("u_seconds"), seconds);
    gl.uniform2f(uniform("u_sheetMm"), ...this.#sheetMm);
    gl.uniform3f(uniform("u_tint"), ...this.tint);
    gl.uniform3f(uniform("u_depthScale"), this.depthScale.near, this.depthScale.far, this.depthScale.step);
    gl.uniform3f(uniform("u_accent"), 0.25, 0.88, 0.72);
    const [imageWidth, imageHeight] = [camera.width * scale, camera.height * scale];
    const bottom = Math.floor(height - top - imageHeight);
    gl.scissor(Math.floor(left), bottom, Math.ceil(imageWidth) + 1, Math.ceil(imageHeight) + 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    if (!meshOverlay) return;
    this.#meshLayer.draw({
      camera,
      view: { left, top, scale },
      canvasSize: [width, height],
      overlay: /** @type {MeshOverlay} */ (this.overlay),
      paper,
      strength,
      seconds,
      sheetMm: this.#sheetMm,
      tint: this.tint,
      depthScale: this.depthScale,
      lineWidth: Math.max(1, LINE_WIDTH * density),
      smallFrame: this.#frame.small,
      heat: this.#textures.heat,
      painted: this.#textures.painted,
    });
  }

  /** Canvas pixels per CSS pixel. */
  #density() {
    const { clientWidth, clientHeight } = this.#canvas;
    if (this.software) return Math.min(1, Math.sqrt(MOST_SOFTWARE_PIXELS / Math.max(1, clientWidth * clientHeight)));
    return this.quality < 1 ? this.quality : Math.min(MOST_DENSITY, devicePixelRatio);
  }

  /**
   * What the image leaves of the canvas: strips above, below and beside it.
   *
   * @param {[number, number]} canvasSize
   * @param {SourcedCamera} camera
   * @param {{ left: number, top: number, scale: number }} view
   */
  #drawBackdrop([width, height], camera, { left, top, scale }) {
    const gl = this.#gl;
    const [right, foot] = [left + camera.width * scale, top + camera.height * scale];
    const strips = [
      [0, 0, width, top],
      [0, foot, width, height - foot],
      [0, 0, left, height],
      [right, 0, width - right, height],
    ].filter(([, , w, h]) => w > 0.5 && h > 0.5);
    if (strips.length === 0) return;
    const { program, uniform } = this.#backdropProgram;
    gl.useProgram(program);
    this.#bind(uniform, ["blurred"]);
    gl.uniform2f(uniform("u_canvasSize"), width, height);
    gl.uniform2f(uniform("u_frameSize"), camera.width, camera.height);
    for (const [x, y, w, h] of strips) {
      gl.scissor(Math.floor(x), Math.floor(height - y - h), Math.ceil(w) + 1, Math.ceil(h) + 1);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }

  /**
   * @param {Program["uniform"]} uniform
   * @param {readonly ((typeof SAMPLERS)[number] | "blurred")[]} samplers
   */
  #bind(uniform, samplers) {
    const gl = this.#gl;
    samplers.forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.#textures[name]);
      gl.uniform1i(uniform(`u_${name}`), unit);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  /**
   * Where on the canvas, in CSS pixels, the network looks; null without a frame.
   *
   * @returns {{ left: number, top: number, width: number, height: number, partial: boolean } | null} partial: the image reaches beyond
   */
  regionOnCanvas() {
    const camera = this.#camera;
    if (!camera) return null;
    const canvas = { width: this.#canvas.clientWidth, height: this.#canvas.clientHeight, ...this.#covered };
    const { scale, left, top, region } = viewOf(canvas, camera);
    const fraction = ((region.right - region.left) * (region.bottom - region.top)) / (camera.width * camera.height);
    return {
      left: left + region.left * scale,
      top: top + region.top * scale,
      width: (region.right - region.left) * scale,
      height: (region.bottom - region.top) * scale,
      partial: fraction < 0.95,
    };
  }
}

/**
 * Whether a region is the whole image, but for a pixel or two at its border.
 *
 * @param {{ left: number, top: number, right: number, bottom: number }} region pixels
 * @param {SourcedCamera} camera
 */
function isWhole({ left, top, right, bottom }, { width, height }) {
  return Math.max(left, top, width - right, height - bottom) < 2;
}
