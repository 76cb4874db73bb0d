// What a scene is drawn on: WebGL's canvas, and where the processor draws another below it for the camera's picture. There WebGL would
// take longer to bring the picture into the page, and the page back out of WebGL's memory, than to draw all that lies over it.

import { isPinhole } from "../camera/lens.js";
import { FrameBackground } from "../three/frame-background.js";
import { extentOf, regionOf } from "./drawn-box.js";

/** @import { TrackedFrame } from "../index.js" */
/** @import { Box } from "./drawn-box.js" */
/** @import { SceneView } from "./scene-view.js" */

/** Canvas pixels per CSS pixel, at most: more cannot be seen and costs time. */
const MAX_DENSITY = 2;
/** Canvas pixels, at most, where the processor draws: of the whole picture, and of the box that something is put into. */
const MAX_SOFTWARE_PIXELS = 330_000;
const MAX_BOX_PIXELS = 110_000;
/** Both sides of the box that is drawn in are whole multiples of this, CSS pixels: each new size is new memory. */
const BOX_STEP = 32;
/** What lies so far beyond the box may still be drawn softly, CSS pixels. */
const MARGIN = 1;

export class SceneLayers {
  #view;
  #isMirrored = false;
  #below;
  /** The frame that the layer below shows. @type {ImageBitmap | null} */
  #shown = null;
  #isHosted;
  #boxSize = { width: 0, height: 0 };
  /** Shows the camera's picture. */
  background = new FrameBackground();
  /** What holds the canvases, and its size, CSS pixels. */
  element = document.createElement("div");
  page = { width: 0, height: 0 };

  /**
   * @param {Pick<SceneView, "renderer" | "scene" | "camera" | "software">} view whose scene gets the camera's picture as its background
   * @param {boolean} isHosted whether the canvas is the page's own, and lies where it is
   */
  constructor(view, isHosted) {
    const below = document.createElement("canvas").getContext("2d", { alpha: false });
    if (!below) throw new Error("This browser offers no canvas to draw a frame on.");
    this.#view = view;
    this.#below = below;
    this.#isHosted = isHosted;
    Object.assign(this.element.style, { position: "absolute", inset: "0" });
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", "The camera's picture, with what is put into it");
    if (!isHosted) this.element.append(view.renderer.domElement);
    view.scene.add(this.background);
  }

  /** @param {boolean} isMirrored whether what is seen is mirrored */
  mirror(isMirrored) {
    this.#isMirrored = isMirrored;
    const mirror = this.#isHosted ? this.#view.renderer.domElement : this.element;
    mirror.style.transform = isMirrored ? "scaleX(-1)" : "";
  }

  /**
   * Draws the scene, whose camera has the intrinsics of the frame.
   *
   * @param {TrackedFrame} tracked that is shown
   */
  draw({ frame, camera: intrinsics }) {
    const { renderer, scene, camera, software } = this.#view;
    if (this.#isHosted) return renderer.render(scene, camera);
    // The shader that takes out a lens' distortion is WebGL's.
    const isApart = software && frame !== null && isPinhole(intrinsics);
    this.background.visible = !isApart;
    if (isApart) return this.#drawApart(frame);
    this.#below.canvas.remove();
    this.#takePlace({ left: 0, top: 0, ...this.page }, software ? MAX_SOFTWARE_PIXELS : Infinity);
    renderer.render(scene, camera);
  }

  /**
   * What was just drawn, not mirrored, in the middle of a canvas.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {string} background CSS colour of what is left of it, also where the window has turned since a recording began
   */
  drawInto(canvas, background) {
    const context = canvas.getContext("2d", { alpha: false });
    if (!context) return canvas;
    const { left, top, width, height } = this.element.getBoundingClientRect();
    const scale = Math.min(canvas.width / width, canvas.height / height);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.fillStyle = background;
    context.fillRect(0, 0, canvas.width, canvas.height);
    for (const layer of this.#isHosted ? [this.#view.renderer.domElement] : this.element.querySelectorAll("canvas")) {
      if (layer.style.visibility === "hidden") continue;
      const box = layer.getBoundingClientRect();
      const fromLeft = this.#isMirrored ? left + width - box.right : box.left - left;
      const [x, y] = [(canvas.width - scale * width) / 2 + scale * fromLeft, (canvas.height - scale * height) / 2 + scale * (box.top - top)];
      context.drawImage(layer, x, y, scale * box.width, scale * box.height);
    }
    return canvas;
  }

  dispose() {
    this.background.removeFromParent();
    this.background.dispose();
  }

  /**
   * The camera's picture on the layer below, and WebGL in the box alone in which something lies over it.
   *
   * @param {ImageBitmap} frame
   */
  #drawApart(frame) {
    const { camera, scene, renderer } = this.#view;
    const whole = camera.region;
    const below = this.#below.canvas;
    if (!below.isConnected) this.element.prepend(below);
    if (below.width !== frame.width || below.height !== frame.height) [below.width, below.height] = [frame.width, frame.height];
    if (frame !== this.#shown) this.#below.drawImage(frame, 0, 0);
    this.#shown = frame;
    const scale = this.page.width / (whole.right - whole.left);
    const { width, height } = camera.intrinsics ?? frame;
    layOut(below, { left: -whole.left * scale, top: -whole.top * scale, width: width * scale, height: height * scale });
    scene.updateMatrixWorld();
    const box = this.#drawnBox();
    renderer.domElement.style.visibility = box ? "" : "hidden";
    if (!box) return;
    camera.lookAtRegion(regionOf(box, whole, this.page));
    this.#takePlace(box, MAX_BOX_PIXELS);
    renderer.render(scene, camera);
    camera.lookAtRegion(whole);
  }

  /** @returns {Box | null} in which something is drawn; null where nothing is */
  #drawnBox() {
    const { page } = this;
    const seen = extentOf(this.#view.scene, this.#view.camera);
    const onPage = (/** @type {number} */ at, /** @type {number} */ side) => Math.min(side, Math.max(0, (0.5 + 0.5 * at) * side));
    const [left, right] = [seen.min.x, seen.max.x].map((x) => onPage(x, page.width));
    const [top, bottom] = [seen.max.y, seen.min.y].map((y) => onPage(-y, page.height));
    if (!(right > left && bottom > top)) return null;
    const stepped = (/** @type {number} */ length, /** @type {number} */ last) =>
      length <= last && length > last - 2 * BOX_STEP ? last : BOX_STEP * Math.ceil(length / BOX_STEP);
    const width = stepped(right - left + 2 * MARGIN, this.#boxSize.width);
    const height = stepped(bottom - top + 2 * MARGIN, this.#boxSize.height);
    this.#boxSize = { width, height };
    return { left: Math.floor(left) - MARGIN, top: Math.floor(top) - MARGIN, width, height };
  }

  /**
   * @param {Box} place of WebGL's canvas
   * @param {number} maxPixels of it
   */
  #takePlace(place, maxPixels) {
    const { renderer } = this.#view;
    const canvas = renderer.domElement;
    const density = Math.min(devicePixelRatio, MAX_DENSITY, Math.sqrt(maxPixels / Math.max(1, place.width * place.height)));
    layOut(canvas, place);
    // A canvas whose size is set is new memory, though it be the same size.
    if (canvas.width === Math.floor(place.width * density) && canvas.height === Math.floor(place.height * density)) return;
    renderer.setPixelRatio(density);
    renderer.setSize(place.width, place.height, false);
  }
}

/**
 * Lays an element out over what it lies in, visible. It is moved by a transform, for which the browser lays nothing else out.
 *
 * @param {HTMLElement} element
 * @param {Box} place
 */
function layOut({ style }, { left, top, width, height }) {
  const [x, y, w, h] = [left, top, width, height].map((length) => `${Math.round(length)}px`);
  const text = `display: block; position: absolute; left: 0px; top: 0px; transform: translate(${x}, ${y}); width: ${w}; height: ${h};`;
  if (style.cssText !== text) style.cssText = text;
}
