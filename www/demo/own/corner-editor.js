// Dragging a print's four corners in a photograph, by finger, mouse or keyboard.

import { isPrintOutline } from "deepsft";
import { part } from "../part.js";
import { canvasOf, contextOf, turned } from "./read-picture.js";

/** @import { PrintCorners } from "deepsft" */

/** Space around the picture, so that a finger gets at corners on its border, CSS pixels. */
const MARGIN = 26;
/** Diameter of the loupe, its magnification of what is on the screen, and its distance from the finger, CSS pixels. */
const LOUPE = 132;
const LOUPE_ZOOM = 3;
const LOUPE_REACH = 108;
/** Steps of an arrow key, CSS pixels. */
const STEP = 1;
const LONG_STEP = 12;
/** Shortest side of the outline, as a fraction of the picture's shorter side. */
const MIN_SIDE = 0.04;

/** @type {Readonly<Record<string, readonly [number, number]>>} */
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @typedef {[[number, number], [number, number], [number, number], [number, number]]} Corners */

export class CornerEditor {
  #stage = part("#corners");
  #shown = part("#corners .picture", HTMLCanvasElement);
  #outline = part("#corners .outline", SVGPathElement);
  #shade = part("#corners .shade", SVGPathElement);
  #handles = /** @type {HTMLButtonElement[]} */ ([...this.#stage.querySelectorAll(".corner")]);
  #loupe = part("#corners .loupe", HTMLCanvasElement);
  #said = part("#corners .said");
  picture = canvasOf(1, 1);
  /** Pixels of the picture. @type {Corners} */
  corners = wholeOf(1, 1);
  /** Where the picture lies on the stage: stage = picture * scale + (left, top), CSS pixels. */
  #view = { left: 0, top: 0, scale: 1 };
  /** @type {() => void} called whenever a corner has moved */
  onChange = () => undefined;

  constructor() {
    this.#handles.forEach((handle, index) => {
      // The corner keeps its distance from the finger, which may take hold anywhere on the handle.
      let [dx, dy] = [0, 0];
      handle.addEventListener("pointerdown", (event) => {
        handle.setPointerCapture(event.pointerId);
        const [x, y] = this.corners[index];
        const { scale } = this.#view;
        [dx, dy] = [x - event.clientX / scale, y - event.clientY / scale];
        handle.dataset.held = "true";
        this.#showLoupe(index);
      });
      handle.addEventListener("pointermove", (event) => {
        if (!handle.hasPointerCapture(event.pointerId)) return;
        const { scale } = this.#view;
        this.#move(index, event.clientX / scale + dx, event.clientY / scale + dy);
        this.#showLoupe(index);
      });
      const end = () => {
        delete handle.dataset.held;
        this.#loupe.hidden = true;
      };
      handle.addEventListener("lostpointercapture", end);
      handle.addEventListener("blur", end);
      handle.addEventListener("keydown", (event) => {
        const way = KEYS[event.key];
        if (!way) return;
        event.preventDefault();
        const step = (event.shiftKey ? LONG_STEP : STEP) / this.#view.scale;
        const [x, y] = this.corners[index];
        this.#move(index, x + way[0] * step, y + way[1] * step);
        this.#showLoupe(index);
        const [px, py] = this.corners[index];
        const percent = (/** @type {number} */ at, /** @type {number} */ of) => `${Math.round((100 * at) / of)} %`;
        this.#said.textContent = `${percent(px, this.picture.width)} across, ${percent(py, this.picture.height)} down`;
      });
    });
    new ResizeObserver(() => this.#place()).observe(this.#stage);
  }

  /** Whether the outline is the whole picture. */
  get isWhole() {
    const whole = wholeOf(this.picture.width, this.picture.height);
    return this.corners.every(([x, y], i) => Math.hypot(x - whole[i][0], y - whole[i][1]) < 0.5);
  }

  /**
   * @param {HTMLCanvasElement} picture
   * @param {Corners} [corners] of the whole picture when absent
   */
  show(picture, corners = wholeOf(picture.width, picture.height)) {
    this.picture = picture;
    this.corners = corners;
    this.#place();
    this.onChange();
  }

  /** Turns the picture by a quarter, clockwise. */
  turn() {
    const picture = turned(this.picture);
    const [a, b, c, d] = this.corners.map(([x, y]) => /** @type {[number, number]} */ ([picture.width - y, x]));
    this.show(picture, [d, a, b, c]);
  }

  /** Draws everything where it belongs on a stage of this size. */
  #place() {
    const { clientWidth, clientHeight } = this.#stage;
    if (clientWidth === 0 || clientHeight === 0) return;
    const { width, height } = this.picture;
    const scale = Math.min((clientWidth - 2 * MARGIN) / width, (clientHeight - 2 * MARGIN) / height);
    const [left, top] = [(clientWidth - width * scale) / 2, (clientHeight - height * scale) / 2];
    this.#view = { left, top, scale };
    const density = Math.min(2, devicePixelRatio);
    const shown = this.#shown;
    shown.style.left = `${left}px`;
    shown.style.top = `${top}px`;
    shown.style.width = `${width * scale}px`;
    shown.style.height = `${height * scale}px`;
    [shown.width, shown.height] = [Math.max(1, width * scale * density), Math.max(1, height * scale * density)];
    contextOf(shown).drawImage(this.picture, 0, 0, shown.width, shown.height);
    this.#draw();
  }

  #draw() {
    const { left, top, scale } = this.#view;
    const [width, height] = [this.picture.width * scale, this.picture.height * scale];
    const points = this.corners.map(([x, y]) => [left + x * scale, top + y * scale]);
    const outline = `M${points.map(([x, y]) => `${x} ${y}`).join("L")}Z`;
    this.#outline.setAttribute("d", outline);
    this.#shade.setAttribute("d", `M${left} ${top}h${width}v${height}h${-width}Z${outline}`);
    points.forEach(([x, y], i) => (this.#handles[i].style.transform = `translate(${x}px, ${y}px)`));
  }

  /**
   * Moves a corner as far as the outline stays one of a print.
   *
   * @param {number} index
   * @param {number} x pixels of the picture
   * @param {number} y
   */
  #move(index, x, y) {
    const { width, height } = this.picture;
    const corners = /** @type {Corners} */ (this.corners.map((corner) => [...corner]));
    corners[index] = [Math.min(width, Math.max(0, x)), Math.min(height, Math.max(0, y))];
    const least = MIN_SIDE * Math.min(width, height);
    if (Math.min(...sidesOf(corners)) < least || !isPrintOutline(corners)) return;
    this.corners = corners;
    this.#draw();
    this.onChange();
  }

  /**
   * Shows the surroundings of a corner enlarged, beside the finger that covers them.
   *
   * @param {number} index
   */
  #showLoupe(index) {
    const loupe = this.#loupe;
    const { left, top, scale } = this.#view;
    const [x, y] = this.corners[index];
    const density = Math.min(2, devicePixelRatio);
    const size = LOUPE * density;
    if (loupe.width !== size) [loupe.width, loupe.height] = [size, size];
    const zoom = LOUPE_ZOOM * scale * density;
    const context = contextOf(loupe);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#0e1013";
    context.fillRect(0, 0, size, size);
    context.setTransform(zoom, 0, 0, zoom, size / 2 - x * zoom, size / 2 - y * zoom);
    context.drawImage(this.picture, 0, 0);
    context.beginPath();
    this.corners.forEach(([cx, cy]) => context.lineTo(cx, cy));
    context.closePath();
    context.lineWidth = (1.5 * density) / zoom;
    context.strokeStyle = "#5fe3bd";
    context.stroke();
    context.setTransform(density, 0, 0, density, size / 2, size / 2);
    context.lineWidth = 1.5;
    context.strokeStyle = "#fff";
    context.beginPath();
    context.arc(0, 0, 5, 0, 2 * Math.PI);
    context.stroke();
    const [px, py] = [left + x * scale, top + y * scale];
    const { clientWidth } = this.#stage;
    const above = py - LOUPE_REACH - LOUPE / 2 >= 0;
    // At the stage's top it goes beside the finger, to the side that has more room.
    const sideways = px < clientWidth / 2 ? LOUPE_REACH : -LOUPE_REACH;
    const [cx, cy] = above ? [px, py - LOUPE_REACH] : [px + sideways, Math.max(LOUPE / 2 + 6, py)];
    const kept = Math.min(clientWidth - LOUPE / 2 - 6, Math.max(LOUPE / 2 + 6, cx));
    loupe.style.transform = `translate(${kept - LOUPE / 2}px, ${cy - LOUPE / 2}px)`;
    loupe.hidden = false;
  }
}

/**
 * @param {number} width
 * @param {number} height
 * @returns {Corners}
 */
function wholeOf(width, height) {
  return [[0, 0], [width, 0], [width, height], [0, height]]; // prettier-ignore
}

/** Lengths of an outline's sides, pixels. @param {PrintCorners} corners */
export function sidesOf(corners) {
  return corners.map(([x, y], i) => Math.hypot(corners[(i + 1) % 4][0] - x, corners[(i + 1) % 4][1] - y));
}
