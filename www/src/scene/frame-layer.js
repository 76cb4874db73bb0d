// The camera's picture on a canvas below that of WebGL, for machines whose processor draws: there WebGL would take longer to bring the
// picture into the page, and the page back out of WebGL's memory, than to draw all that lies over it.

import { Box3, Vector3 } from "three";
import { SurfaceGeometry } from "../three/surface-geometry.js";

/** @import { BufferGeometry, Object3D } from "three" */
/** @import { FrameCamera, Region } from "../three/frame-camera.js" */

/** Both sides of the box that is drawn in are whole multiples of this, CSS pixels: each new size is new memory. */
const BOX_STEP = 32;
/** What lies so far beyond the box may still be drawn softly, CSS pixels. */
const MARGIN = 1;

/** The camera's picture, and the box over it that WebGL draws in. */
export class FrameLayer {
  #context;
  #size = { width: 0, height: 0 };

  constructor() {
    const context = document.createElement("canvas").getContext("2d", { alpha: false });
    if (!context) throw new Error("This browser offers no canvas to draw a frame on.");
    this.#context = context;
    layOut(this.canvas, { left: 0, top: 0, width: 1, height: 1 });
  }

  /** What it is shown on. */
  get canvas() {
    return this.#context.canvas;
  }

  /** Takes over a frame. @param {ImageBitmap} frame */
  take(frame) {
    const { canvas } = this;
    if (canvas.width !== frame.width || canvas.height !== frame.height) [canvas.width, canvas.height] = [frame.width, frame.height];
    this.#context.drawImage(frame, 0, 0);
  }

  /**
   * Lays it where the camera sees it.
   *
   * @param {FrameCamera} camera
   * @param {{ width: number }} page what the whole image is laid out on, CSS pixels
   */
  place({ intrinsics, region }, page) {
    const scale = page.width / (region.right - region.left);
    const { width, height } = intrinsics ?? this.canvas;
    layOut(this.canvas, { left: -region.left * scale, top: -region.top * scale, width: width * scale, height: height * scale });
  }

  /**
   * The box on the page in which something of a scene is drawn.
   *
   * @param {Object3D} scene whose matrices are those of now
   * @param {FrameCamera} camera that sees the whole page
   * @param {{ width: number, height: number }} page CSS pixels
   * @returns {{ left: number, top: number, width: number, height: number } | null} null where nothing is
   */
  boxOf(scene, camera, page) {
    const seen = extentOf(scene, camera);
    const onPage = (/** @type {number} */ at, /** @type {number} */ side) => Math.min(side, Math.max(0, (0.5 + 0.5 * at) * side));
    const [left, right] = [seen.min.x, seen.max.x].map((x) => onPage(x, page.width));
    const [top, bottom] = [seen.max.y, seen.min.y].map((y) => onPage(-y, page.height));
    if (!(right > left && bottom > top)) return null;
    const stepped = (/** @type {number} */ length, /** @type {number} */ last) =>
      length <= last && length > last - 2 * BOX_STEP ? last : BOX_STEP * Math.ceil(length / BOX_STEP);
    const width = stepped(right - left + 2 * MARGIN, this.#size.width);
    const height = stepped(bottom - top + 2 * MARGIN, this.#size.height);
    this.#size = { width, height };
    return { left: Math.floor(left) - MARGIN, top: Math.floor(top) - MARGIN, width, height };
  }
}

/**
 * Lays an element out over what it lies in. It is moved by a transform, for which the browser lays nothing else out.
 *
 * @param {HTMLElement} element
 * @param {{ left: number, top: number, width: number, height: number }} place CSS pixels
 */
export function layOut({ style }, { left, top, width, height }) {
  const [x, y, w, h] = [left, top, width, height].map((length) => `${Math.round(length)}px`);
  const text = `display: block; position: absolute; left: 0px; top: 0px; transform: translate(${x}, ${y}); width: ${w}; height: ${h};`;
  if (style.cssText !== text) style.cssText = text;
}

/**
 * The part of an image that a box on the page shows.
 *
 * @param {{ left: number, top: number, width: number, height: number }} box
 * @param {Region} region that the whole page shows
 * @param {{ width: number }} page
 * @returns {Region}
 */
export function regionOf(box, region, page) {
  const scale = (region.right - region.left) / page.width;
  const [left, top] = [region.left + box.left * scale, region.top + box.top * scale];
  return { left, top, right: left + box.width * scale, bottom: top + box.height * scale };
}

/**
 * Where anything of a scene is drawn.
 *
 * @param {Object3D} scene whose matrices are those of now
 * @param {FrameCamera} camera
 * @returns {Box3} in clip space; it reaches everywhere where something lies beside the eye
 */
export function extentOf(scene, camera) {
  const seen = new Box3();
  const add = (/** @type {Object3D} */ object) => {
    if (!object.visible) return;
    if (isDrawn(object)) addTo(seen, object, camera);
    object.children.forEach(add);
  };
  add(scene);
  return seen;
}

/** Whether it leaves anything in the picture. @param {Object3D} object */
function isDrawn(object) {
  if (!["isMesh", "isLine", "isPoints", "isSprite"].some((kind) => kind in object)) return false;
  const materials = [/** @type {import("three").Mesh} */ (object).material].flat();
  return materials.some(({ visible, colorWrite }) => visible && colorWrite);
}

/**
 * Adds where an object is seen: each vertex of a tracked surface, of others the corners of their box.
 *
 * @param {Box3} seen in the camera's clip space
 * @param {Object3D} object
 * @param {FrameCamera} camera
 */
function addTo(seen, object, camera) {
  const geometry = /** @type {BufferGeometry} */ (/** @type {{ geometry?: unknown }} */ (object).geometry);
  const positions = geometry.getAttribute("position");
  const point = new Vector3();
  const add = () => {
    point.applyMatrix4(object.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
    // What lies beside the eye or behind it is anywhere.
    if (point.z > -camera.near) return void [-1, 1].forEach((far) => seen.expandByPoint(point.setScalar(far)));
    seen.expandByPoint(point.applyMatrix4(camera.projectionMatrix));
  };
  if (geometry instanceof SurfaceGeometry) {
    for (let i = 0; i < positions.count; i++) {
      point.fromBufferAttribute(positions, i);
      add();
    }
    return;
  }
  // Bones and instances move.
  const moving = "computeBoundingBox" in object ? /** @type {import("three").InstancedMesh} */ (object) : null;
  if (moving ?? !geometry.boundingBox) (moving ?? geometry).computeBoundingBox();
  const box = /** @type {Box3} */ ((moving ?? geometry).boundingBox);
  if (box.isEmpty()) return;
  const { min, max } = box;
  for (let i = 0; i < 8; i++) {
    point.set(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
    add();
  }
}
