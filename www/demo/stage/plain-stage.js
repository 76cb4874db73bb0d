// The stage without WebGL: frame and mesh on plain canvases.

import { verticesInImage } from "deepsft";
import { FrameCanvas, layOut } from "./frame-canvas.js";
import { heatRow } from "../graphics/heat.js";
import { regionOnPage, viewOf } from "./view.js";

/** @import { MeshTopology, SourcedCamera, SurfaceMesh } from "deepsft" */
/** @import { Overlay } from "./stage.js" */
/** @import { Paper } from "../graphics/papers.js" */
/** @import { ObjectName } from "../objects/objects.js" */

const HEAT_COLOURS = 256;
/** From the sheet to the light, camera frame, of length 1. */
const LIGHT = /** @type {const} */ ([-0.62, -0.62, -0.48]);
/** Front and back of plaster in full light, RGB. */
const FRONT = /** @type {const} */ ([236, 231, 220]);
const BACK = /** @type {const} */ ([206, 112, 84]);
const LINE = "rgb(115 255 209 / 0.75)";
const LINE_WIDTH = 1.1;
/** Faces overlap by so much, CSS pixels: else the frame shines through between them. */
const OVERLAP = 0.8;

/** Draws what {@link Stage} draws, as far as a plain canvas can: no prints and no maps. */
export class PlainStage {
  #canvas;
  #context;
  #below;
  #heat;
  /** @type {MeshTopology["faces"]} */
  #faces = new Uint32Array();
  /** @type {SurfaceMesh | null} */
  #mesh = null;
  /** @type {SourcedCamera | null} */
  #camera = null;
  #covered = { top: 0, bottom: 0 };
  software = true;
  animated = false;
  quality = 1;
  depthScale = { near: 0, far: 1, step: 1 };
  /** @type {readonly [number, number, number]} not used: nothing printed is drawn */
  tint = [1, 1, 1];
  /** @type {Paper} likewise */
  paper = "aurora";
  /** @type {ObjectName} likewise */
  object = "house";
  /** What can be drawn. @type {readonly Overlay[]} */
  overlays = ["shaded", "mesh", "depth", "plain"];
  /** @type {Overlay} */
  overlay = "mesh";
  /** There is always time for another frame. */
  busy = true;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} below what lies below it, for {@link FrameCanvas}
   */
  constructor(canvas, below) {
    const context = canvas.getContext("2d");
    if (!context) throw new Error("This browser offers no canvas to draw on.");
    this.#canvas = canvas;
    this.#context = context;
    this.#below = new FrameCanvas(below);
    this.#heat = heatRow(HEAT_COLOURS);
  }

  /** @param {{ mesh: MeshTopology }} template */
  setTemplate({ mesh }) {
    this.#faces = mesh.faces;
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
   * Takes over a frame; it may be closed afterwards. Its maps are not drawn.
   *
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} shown
   */
  showMaps(shown) {
    this.showMesh(shown, null);
  }

  /**
   * Takes over a frame with the mesh in it; the frame may be closed afterwards.
   *
   * @param {{ frame: ImageBitmap | null, camera: SourcedCamera }} shown
   * @param {SurfaceMesh | null} mesh null when nothing is followed
   */
  showMesh({ frame, camera }, mesh) {
    this.#camera = camera;
    if (frame) this.#below.show(frame, camera);
    this.addMesh(mesh);
  }

  /** @param {SurfaceMesh | null} mesh in the frame that is shown already */
  addMesh(mesh) {
    this.#mesh = mesh;
  }

  /** Forgets the frame. */
  clear() {
    this.#camera = null;
    this.#mesh = null;
  }

  /** Draws the newest frame. */
  draw() {
    const [camera, mesh] = [this.#camera, this.#mesh];
    this.#canvas.hidden = !camera || !mesh || this.overlay === "plain";
    if (!camera) return this.#below.clear();
    const page = this.#pageSize();
    const view = viewOf({ ...page, ...this.#covered }, camera);
    this.#below.place(camera, view);
    if (this.#canvas.hidden || !mesh) return;
    layOut(this.#canvas, { left: 0, top: 0, ...page });
    if (this.#canvas.width !== page.width || this.#canvas.height !== page.height)
      [this.#canvas.width, this.#canvas.height] = [page.width, page.height];
    const context = this.#context;
    context.clearRect(0, 0, page.width, page.height);
    context.save();
    // Nothing of it beyond the image.
    context.beginPath();
    context.rect(view.left, view.top, camera.width * view.scale, camera.height * view.scale);
    context.clip();
    context.translate(view.left, view.top);
    const points = verticesInImage(mesh.vertices, camera, view.scale);
    if (this.overlay === "mesh") this.#drawLines(points);
    else this.#drawFaces(points, mesh);
    context.restore();
  }

  /** Nothing stands on the sheet here. */
  placeObjectAt() {}

  /** Nothing stands on the sheet here. */
  moveObject() {}

  /** Where on the page, in CSS pixels, the network looks; null without a frame. */
  regionOnCanvas() {
    return this.#camera && regionOnPage({ ...this.#pageSize(), ...this.#covered }, this.#camera);
  }

  /** @param {Float32Array} points (x, y) of each vertex */
  #drawLines(points) {
    const context = this.#context;
    context.beginPath();
    for (let face = 0; face < this.#faces.length; face += 3) this.#outline(face, points);
    context.strokeStyle = LINE;
    context.lineWidth = LINE_WIDTH;
    context.stroke();
  }

  /**
   * The farthest first: what lies before them covers them.
   *
   * @param {Float32Array} points (x, y) of each vertex
   * @param {SurfaceMesh} mesh
   */
  #drawFaces(points, mesh) {
    const context = this.#context;
    const faces = this.#faces;
    const depths = Float32Array.from({ length: faces.length / 3 }, (_, i) => {
      const depthOf = (/** @type {number} */ corner) => mesh.vertices[3 * faces[3 * i + corner] + 2];
      return (depthOf(0) + depthOf(1) + depthOf(2)) / 3;
    });
    context.lineWidth = OVERLAP;
    for (const i of Uint32Array.from(depths.keys()).sort((a, b) => depths[b] - depths[a])) {
      context.fillStyle = this.overlay === "depth" ? this.#heatColour(depths[i]) : this.#plasterColour(3 * i, points, mesh);
      context.strokeStyle = context.fillStyle;
      context.beginPath();
      this.#outline(3 * i, points);
      context.fill();
      context.stroke();
    }
  }

  /** @param {number} face first of its three places in the list @param {Float32Array} points */
  #outline(face, points) {
    const [a, b, c] = [0, 1, 2].map((corner) => 2 * this.#faces[face + corner]);
    this.#context.moveTo(points[a], points[a + 1]);
    this.#context.lineTo(points[b], points[b + 1]);
    this.#context.lineTo(points[c], points[c + 1]);
    this.#context.closePath();
  }

  /** @param {number} depth mm */
  #heatColour(depth) {
    const { near, far } = this.depthScale;
    const at = 4 * Math.round((HEAT_COLOURS - 1) * Math.min(1, Math.max(0, (depth - near) / (far - near))));
    return `rgb(${this.#heat[at]} ${this.#heat[at + 1]} ${this.#heat[at + 2]})`;
  }

  /**
   * @param {number} face first of its three places in the list
   * @param {Float32Array} points
   * @param {SurfaceMesh} mesh
   */
  #plasterColour(face, points, { normals }) {
    const [a, b, c] = [0, 1, 2].map((corner) => this.#faces[face + corner]);
    const along = (/** @type {number} */ from, /** @type {number} */ to, /** @type {number} */ k) => points[2 * to + k] - points[2 * from + k];
    // Counter-clockwise from the front, in an image whose y points down.
    const isFront = along(a, b, 0) * along(a, c, 1) - along(a, b, 1) * along(a, c, 0) < 0;
    const towards = LIGHT.reduce((sum, light, k) => sum + light * (normals[3 * a + k] + normals[3 * b + k] + normals[3 * c + k]), 0) / 3;
    const light = 0.42 + 0.58 * Math.max(0, isFront ? towards : -towards);
    return `rgb(${(isFront ? FRONT : BACK).map((full) => Math.round(full * light)).join(" ")})`;
  }

  /** What the stage fills of the page, CSS pixels. */
  #pageSize() {
    const { clientWidth = 0, clientHeight = 0 } = this.#canvas.parentElement ?? {};
    return { width: clientWidth, height: clientHeight };
  }
}
