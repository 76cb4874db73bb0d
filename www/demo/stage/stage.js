// The stage: the canvas on which frame and overlay are drawn.

import { CANONICAL_FOCAL, canonicalSize, lensUniform } from "deepsft";
import { VertexLight } from "deepsft/light";
import { FrameCanvas, layOut } from "./frame-canvas.js";
import { FramePicture } from "./frame-picture.js";
import { createTexture, programVariants, webGlOf } from "../graphics/gl.js";
import { heatRow } from "../graphics/heat.js";
import { MeshLayer } from "./mesh-layer.js";
import { MESH_OVERLAYS } from "./mesh-shader.js";
import { ObjectLayer } from "./object-layer.js";
import { PaintedPaper } from "./painted-paper.js";
import { shadingSize } from "./shading.js";
import { softMask } from "./soft-mask.js";
import { BACKDROP_FRAGMENT_SHADER, MAP_OVERLAYS, VERTEX_SHADER, stageFragmentShader } from "./stage-shader.js";
import { boundsInImage, imagePlaceOf, regionOnPage, viewOf } from "./view.js";

/** @import { Estimate, SourcedCamera, SurfaceMesh, Target } from "deepsft" */
/** @import { Program } from "../graphics/gl.js" */
/** @import { PaperSource } from "../graphics/papers.js" */
/** @import { TemplateLight } from "deepsft/light" */
/** @import { MeshView } from "./mesh-layer.js" */
/** @import { MeshOverlay } from "./mesh-shader.js" */
/** @import { MapOverlay } from "./stage-shader.js" */
/** @import { Paper } from "../graphics/papers.js" */
/** @import { ObjectName } from "../objects/objects.js" */

/** @typedef {"paper" | "object" | "shaded" | "mesh" | "depth" | "mask" | "plain"} Overlay */

/** Canvas pixels per CSS pixel, at most: more cannot be seen and costs time. */
const MAX_DENSITY = 2;
/** Canvas pixels, at most, where the processor draws. */
const MAX_SOFTWARE_PIXELS = 330_000;
/** The same of the box that the mesh of a video's frame is drawn in. */
const MAX_MESH_PIXELS = 110_000;
/** Of the box that a mesh alone is drawn in, both sides are whole multiples of this, CSS pixels. */
const BOX_STEP = 32;
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
  #backdropPrograms;
  #frame;
  /** Where the processor draws: shows the frame below this canvas, which then has only the mesh. @type {FrameCanvas | null} */
  #below = null;
  #paintedPaper;
  #textures;
  #meshLayer;
  #objectLayer;
  /** The mesh that belongs to the frame, and whether the maps do. @type {SurfaceMesh | null} */
  #mesh = null;
  #hasMaps = false;
  /** Overlays whose shader has been compiled. @type {Set<Overlay>} */
  #rehearsed = new Set();
  /** @type {SourcedCamera | null} */
  #camera = null;
  /** Focal length of the canonical image that the maps belong to, pixels. */
  #focal = CANONICAL_FOCAL;
  #foundSince = Infinity;
  /** Size of the box that a mesh alone was last drawn in. */
  #box = { width: 0, height: 0 };
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
  /** What can be drawn. @type {readonly Overlay[]} */
  overlays = ["paper", "object", "shaded", "mesh", "depth", "mask", "plain"];

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} below what lies below it, for {@link FrameCanvas}
   * @param {boolean} software whether the processor does the drawing
   * @throws {NoWebGl}
   */
  constructor(canvas, below, software) {
    const gl = webGlOf(canvas, { alpha: software, antialias: !software, powerPreference: "high-performance" });
    this.#canvas = canvas;
    this.#gl = gl;
    this.software = software;
    if (software) this.#below = new FrameCanvas(below);
    this.#programs = programVariants(gl, VERTEX_SHADER, stageFragmentShader);
    this.#backdropPrograms = programVariants(gl, VERTEX_SHADER, () => BACKDROP_FRAGMENT_SHADER);
    this.#meshLayer = new MeshLayer(gl);
    this.#objectLayer = new ObjectLayer(gl, software);
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

  /**
   * @param {Target} template
   * @param {TemplateLight} light
   */
  setTemplate(template, light) {
    this.#sheetMm = [template.widthMm, template.heightMm];
    const vertexLight = new VertexLight(template.mesh, light);
    this.#meshLayer.setTemplate(template, vertexLight);
    this.#objectLayer.setTemplate(template, vertexLight);
  }

  /** What stands on the sheet. */
  get object() {
    return this.#objectLayer.name;
  }

  /** @param {ObjectName} name */
  set object(name) {
    this.#objectLayer.name = name;
  }

  /**
   * Has the object stand where the sheet is seen on the page.
   *
   * @param {number} x CSS pixels from the stage's left border
   * @param {number} y from its top
   */
  placeObjectAt(x, y) {
    const camera = this.#camera;
    if (!camera || !this.#mesh) return;
    const place = this.#mesh.placeAt(...imagePlaceOf({ ...this.#pageSize(), ...this.#covered }, camera, x, y), camera);
    if (place) this.#objectLayer.place = place;
  }

  /**
   * @param {number} u how far the object is moved, of the print's sides
   * @param {number} v
   */
  moveObject(u, v) {
    const [atU, atV] = this.#objectLayer.place;
    this.#objectLayer.place = [atU + u, atV + v];
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
    this.#hasMaps = shading !== null;
    this.#showFrame(estimate, this.#hasMaps);
    this.addMesh(null, new Float32Array());
    this.#focal = estimate.focal;
    if (!shading) return;
    const { width: w, height: h } = estimate.mask;
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.depth);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, w, h, 0, gl.RED, gl.FLOAT, estimate.depth.values());
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.registration);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG32F, w, h, 0, gl.RG, gl.FLOAT, estimate.registration.values());
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.coverage);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, w, h, 0, gl.RED, gl.UNSIGNED_BYTE, softMask(estimate.mask.values(), w));
    gl.bindTexture(gl.TEXTURE_2D, this.#textures.shading);
    const cells = shadingSize(estimate.mask);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, cells.width, cells.height, 0, gl.RED, gl.FLOAT, shading);
  }

  /**
   * Takes over a frame with the mesh in it; the frame may be closed afterwards.
   *
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} tracked
   * @param {SurfaceMesh | null} mesh null when nothing is followed
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
   */
  showMesh(tracked, mesh, seen) {
    this.#hasMaps = false;
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
    this.#mesh = mesh;
    if (mesh) this.#meshLayer.setMesh(mesh, seen);
    this.#objectLayer.follow(mesh, seen, performance.now());
  }

  /**
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} shown
   * @param {boolean} found
   */
  #showFrame({ frame, camera }, found) {
    this.#camera = camera;
    if (frame) this.#below?.show(frame, camera);
    // Maps are drawn in one pass with the frame under them.
    if (frame && (!this.#below || this.#hasMaps)) this.#frame.upload(frame);
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
    this.#mesh = null;
    this.#hasMaps = false;
    this.#foundSince = Infinity;
  }

  /**
   * Draws the newest frame.
   *
   * @param {number} seconds for papers that move
   */
  draw(seconds) {
    const [gl, camera] = [this.#gl, this.#camera];
    const page = this.#pageSize();
    if (!camera) {
      this.#below?.clear();
      this.#canvas.hidden = false;
      this.#takePlace({ left: 0, top: 0, ...page });
      gl.clearColor(0.055, 0.063, 0.075, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      return;
    }
    const onPage = viewOf({ ...page, ...this.#covered }, camera);
    const mesh = this.overlay in MESH_OVERLAYS ? this.#mesh : null;
    // Without maps that shader shows nothing yet; a GPU's driver compiles it now and not when the sheet is found.
    const fromMaps = !mesh && (this.#hasMaps || !this.#below) && this.overlay in MAP_OVERLAYS;
    const alone = this.#below !== null && !fromMaps;
    if (alone) this.#below?.place(camera, onPage);
    this.#canvas.hidden = alone && !mesh;
    if (alone && !mesh) return this.#rehearse(camera);
    const place = alone && mesh ? this.#placeOf(mesh, camera, onPage) : { left: 0, top: 0, ...page };
    // A mesh that has maps beside it is of a single image: it has time.
    const density = this.#takePlace(place, alone && !this.#hasMaps ? MAX_MESH_PIXELS : MAX_SOFTWARE_PIXELS);
    const [left, top] = [(onPage.left - place.left) * density, (onPage.top - place.top) * density];
    const view = { left, top, scale: onPage.scale * density };
    const age = (performance.now() - this.#foundSince) / 1000;
    const strength = Math.min(1, Math.max(0, age / APPEAR_SECONDS));
    if (mesh && !alone && this.overlay === "paper") this.#frame.prepareSmall();
    if (mesh && this.overlay === "object") this.#objectLayer.prepare(camera, () => (this.#below ?? this.#frame).pixels, seconds);
    if (alone) {
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
    } else {
      const overlay = fromMaps ? /** @type {MapOverlay} */ (this.overlay) : "plain";
      this.#drawFrame({ camera, view, region: onPage.region, overlay, strength, seconds });
    }
    if (mesh) this.#drawMesh({ camera, view, strength, seconds, lineWidth: Math.max(1, LINE_WIDTH * density) });
  }

  /**
   * Draws a mesh that shows nothing while there is none. A shader takes the processor longest to compile when it is first drawn with:
   * the first mesh would wait for it.
   *
   * @param {SourcedCamera} camera
   */
  #rehearse(camera) {
    if (!(this.overlay in MESH_OVERLAYS) || this.#rehearsed.has(this.overlay)) return;
    this.#rehearsed.add(this.overlay);
    this.#drawMesh({ camera, view: { left: 0, top: 0, scale: 1 }, strength: 0, seconds: 0, lineWidth: 1 });
  }

  /** What the print is drawn from, painted if need be. @returns {PaperSource} */
  #paperSource() {
    if (!this.software) return this.paper;
    if (this.overlay === "paper") this.#paintedPaper.paint(this.paper, this.#sheetMm, STILL_SECONDS);
    return "painted";
  }

  /** @param {Pick<MeshView, "camera" | "view" | "strength" | "seconds" | "lineWidth">} drawn */
  #drawMesh(drawn) {
    this.#meshLayer.draw({
      ...drawn,
      paper: this.#paperSource(),
      canvasSize: this.#canvasSize(),
      overlay: /** @type {MeshOverlay} */ (this.overlay),
      sheetMm: this.#sheetMm,
      tint: this.tint,
      depthScale: this.depthScale,
      frame: this.#below ?? this.#frame,
      heat: this.#textures.heat,
      painted: this.#textures.painted,
      object: this.#objectLayer,
    });
  }

  /**
   * The frame, what is drawn from the maps, and what lies beside the frame.
   *
   * @param {object} drawn
   * @param {SourcedCamera} drawn.camera
   * @param {{ left: number, top: number, scale: number }} drawn.view of the image on the canvas, canvas pixels
   * @param {ReturnType<typeof viewOf>["region"]} drawn.region of the image that the network sees
   * @param {MapOverlay | "plain"} drawn.overlay
   * @param {number} drawn.strength
   * @param {number} drawn.seconds
   */
  #drawFrame({ camera, view, region, overlay, strength, seconds }) {
    const gl = this.#gl;
    const [width, height] = this.#canvasSize();
    const { left, top, scale } = view;
    this.#frame.prepare(scale);
    this.#drawBackdrop([width, height], camera, view);
    gl.enable(gl.SCISSOR_TEST);
    const { program, uniform } = this.#programs(overlay, this.#paperSource(), isWhole(region, camera) ? "whole" : "part");
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    this.#bind(uniform, SAMPLERS);
    gl.uniform2f(uniform("u_canvasSize"), width, height);
    gl.uniform3f(uniform("u_view"), left, top, scale);
    gl.uniform2f(uniform("u_frameSize"), camera.width, camera.height);
    gl.uniform4f(uniform("u_camera"), camera.fx, camera.fy, camera.cx, camera.cy);
    gl.uniform1fv(uniform("u_lens"), lensUniform(camera));
    gl.uniform4f(uniform("u_region"), region.left, region.top, region.right, region.bottom);
    const canonical = canonicalSize(camera);
    gl.uniform3f(uniform("u_canonical"), canonical.width, canonical.height, this.#focal);
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
  }

  /** What the stage fills of the page, CSS pixels. */
  #pageSize() {
    const { clientWidth = 0, clientHeight = 0 } = this.#canvas.parentElement ?? {};
    return { width: clientWidth, height: clientHeight };
  }

  /** @returns {[number, number]} pixels */
  #canvasSize() {
    return [this.#canvas.width, this.#canvas.height];
  }

  /**
   * The box that a mesh is drawn in, where that is all that is drawn. It moves by whole pixels, which the browser then only copies, and
   * has few sizes: each new one is new memory.
   *
   * @param {SurfaceMesh} mesh
   * @param {SourcedCamera} camera
   * @param {{ left: number, top: number, scale: number }} view CSS pixels
   */
  #placeOf({ vertices }, camera, { left, top, scale }) {
    const drawn = this.overlay === "object" ? Float32Array.of(...vertices, ...this.#objectLayer.bounds) : vertices;
    const bounds = boundsInImage(drawn, camera);
    const stepped = (/** @type {number} */ length, /** @type {number} */ last) =>
      length <= last && length > last - 2 * BOX_STEP ? last : BOX_STEP * Math.ceil(length / BOX_STEP);
    const width = stepped(Math.max(0, bounds.right - bounds.left) * scale + 2, this.#box.width);
    const height = stepped(Math.max(0, bounds.bottom - bounds.top) * scale + 2, this.#box.height);
    this.#box = { width, height };
    return { left: Math.floor(left + bounds.left * scale) - 1, top: Math.floor(top + bounds.top * scale) - 1, width, height };
  }

  /**
   * Lays the canvas out.
   *
   * @param {{ left: number, top: number, width: number, height: number }} place on the page, CSS pixels
   * @param {number} [maxPixels] of the canvas, where the processor draws
   * @returns {number} canvas pixels per CSS pixel
   */
  #takePlace(place, maxPixels = MAX_SOFTWARE_PIXELS) {
    const canvas = this.#canvas;
    if (this.software) layOut(canvas, place);
    const most = Math.min(1, Math.sqrt(maxPixels / Math.max(1, place.width * place.height)));
    const density = this.software ? most : this.quality < 1 ? this.quality : Math.min(MAX_DENSITY, devicePixelRatio);
    const [width, height] = [Math.round(place.width * density), Math.round(place.height * density)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    return density;
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
    this.#frame.prepareBlurred();
    const { program, uniform } = this.#backdropPrograms();
    gl.enable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
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
   * @returns {ReturnType<typeof regionOnPage> | null}
   */
  regionOnCanvas() {
    const camera = this.#camera;
    if (!camera) return null;
    return regionOnPage({ ...this.#pageSize(), ...this.#covered }, camera);
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
