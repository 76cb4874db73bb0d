// The person's own picture on its way to the library: its corners, its size in print.

import { estimatedCamera, printAspect, rectifyPicture } from "deepsft";
import { part } from "../part.js";
import { CornerEditor, sidesOf } from "./corner-editor.js";
import { MIN_MM, MAX_MM, formatLength, isUsableLength, largestOn, layOut, parseLength } from "./print-size.js";
import { MAX_PICTURE_LENGTH, canvasOf, contextOf } from "./read-picture.js";

/** @import { Corners } from "./corner-editor.js" */
/** @import { Unit, UsualSize } from "./print-size.js" */
/** @import { OpenedPicture } from "./read-picture.js" */

/** @typedef {UsualSize | "own" | "unknown"} SizeChoice */

/**
 * A flat picture with its size.
 *
 * @typedef {object} ReadyPicture
 * @property {HTMLCanvasElement} canvas
 * @property {string} name
 * @property {number} widthMm
 * @property {number} heightMm
 * @property {boolean} hasSize whether the size is the print's, or made up
 */

/** Longest side of the small flat picture beside the size, CSS pixels. */
const PREVIEW_LENGTH = 220;
/** What a print of unknown size is taken for, as far as it fits. @type {UsualSize} */
const MADE_UP = "a4";
const UNIT_KEY = "deepsft/unit";

export class PictureEditor {
  #root = part("#editor");
  #corners = new CornerEditor();
  #width = part("#print-width", HTMLInputElement);
  #height = part("#print-height", HTMLInputElement);
  #preview = part("#flat", HTMLCanvasElement);
  #problem = part("#size-problem");
  #whole = part("#whole", HTMLButtonElement);
  #name = "";
  /** Those of the picture. @type {ImageData | null} */
  #pixels = null;
  /** @type {SizeChoice | null} */
  #usual = null;
  /** mm; NaN where none was said. */
  #widthMm = Number.NaN;
  /** Width over height that was said for a photographed print, rather than taken from its corners; NaN where none was. */
  #saidAspect = Number.NaN;
  /** @type {Unit} */
  #unit = "mm";
  #previewing = 0;
  /** @type {(picture: ReadyPicture, use: "camera" | "image") => void} */
  onReady = () => undefined;

  constructor() {
    this.#corners.onChange = () => this.#follow();
    this.#whole.addEventListener("click", () => this.#corners.show(this.#corners.picture));
    part("#turn").addEventListener("click", () => this.#turn());
    // Each click, for who chooses their own size again wants to type it. The arrow keys, whose clicks count none, may want to go on.
    part("#usual-sizes").addEventListener("click", ({ target, detail }) => {
      if (!(target instanceof HTMLInputElement)) return;
      this.#choose(/** @type {SizeChoice} */ (target.value));
      if (target.value === "own" && detail > 0) this.#width.select();
    });
    part("#units").addEventListener("change", ({ target }) => target instanceof HTMLInputElement && this.#measureIn(/** @type {Unit} */ (target.value)));
    this.#width.addEventListener("input", () => this.#takeWidth());
    this.#height.addEventListener("input", () => this.#takeHeight());
    for (const input of [this.#width, this.#height])
      input.addEventListener("change", () => this.#showSize());
    part("#print-size").addEventListener("submit", (event) => {
      event.preventDefault();
      const use = event.submitter instanceof HTMLButtonElement && event.submitter.value === "image" ? "image" : "camera";
      this.#finish(use);
    });
    this.#measureIn(rememberedUnit());
  }

  /**
   * @param {OpenedPicture} picture
   * @param {{ corners?: Corners, widthMm?: number, hasSize?: boolean }} [known] what is known of it already
   */
  open(picture, { corners, widthMm = Number.NaN, hasSize = true } = {}) {
    this.#root.hidden = false;
    this.#name = picture.name;
    this.#pixels = pixelsOf(picture.canvas);
    [this.#usual, this.#widthMm, this.#saidAspect] = [hasSize ? null : "unknown", widthMm, Number.NaN];
    part("#own-name").textContent = picture.name;
    part("#transparent").hidden = !picture.transparent;
    this.#root.dataset.photographed = String(corners !== undefined);
    this.#say("");
    this.#corners.show(picture.canvas, corners);
    this.#showSize();
    // Where keyboards and screen readers go on; a field would open a phone's keyboard over the picture.
    part("#print-size h2").focus({ preventScroll: true });
  }

  close() {
    this.#root.hidden = true;
    this.#pixels = null;
  }

  /** Width over height of the print: its own where the picture is not cropped, else what was said or what its corners tell. */
  get #aspect() {
    const { width, height } = this.#corners.picture;
    if (this.#corners.isWhole) return width / height;
    if (Number.isFinite(this.#saidAspect)) return this.#saidAspect;
    return printAspect(this.#corners.corners, estimatedCamera(width, height));
  }

  #turn() {
    // What was its height is its width now.
    this.#widthMm /= this.#aspect;
    this.#saidAspect = 1 / this.#saidAspect;
    this.#corners.turn();
    this.#pixels = pixelsOf(this.#corners.picture);
  }

  /** @param {SizeChoice} usual */
  #choose(usual) {
    this.#usual = usual;
    this.#say("");
    if (usual === "own" || usual === "unknown") this.#saidAspect = Number.NaN;
    this.#follow();
  }

  /** Makes the size that of the usual sheet that was chosen. */
  #applyUsual() {
    if (this.#usual === null || this.#usual === "own") return;
    if (this.#usual === "unknown" || this.#corners.isWhole) {
      const usual = this.#usual === "unknown" ? MADE_UP : this.#usual;
      this.#widthMm = largestOn(usual, this.#aspect).widthMm;
      return;
    }
    this.#saidAspect = Number.NaN;
    const [width, height] = layOut(this.#usual, this.#aspect);
    [this.#widthMm, this.#saidAspect] = [width, width / height];
  }

  #takeWidth() {
    this.#widthMm = parseLength(this.#width.value, this.#unit);
    this.#becomeOwn();
    if (this.#widthMm > 0) this.#height.value = formatLength(this.#widthMm / this.#aspect, this.#unit);
  }

  #takeHeight() {
    const heightMm = parseLength(this.#height.value, this.#unit);
    if (this.#usual === "unknown") this.#widthMm = Number.NaN;
    this.#becomeOwn();
    if (!(heightMm > 0)) return;
    if (this.#corners.isWhole || !(this.#widthMm > 0)) {
      this.#widthMm = heightMm * this.#aspect;
      this.#width.value = formatLength(this.#widthMm, this.#unit);
    } else {
      this.#saidAspect = this.#widthMm / heightMm;
      this.#schedulePreview();
    }
  }

  /** What was typed is nobody's usual size. */
  #becomeOwn() {
    this.#usual = "own";
    this.#say("");
    this.#check();
  }

  /** @param {Unit} unit */
  #measureIn(unit) {
    this.#unit = unit;
    try {
      localStorage.setItem(UNIT_KEY, unit);
    } catch {
      // Then it is asked for again next time.
    }
    check("unit", unit);
    this.#showSize();
  }

  /** After a corner has moved, or a size was chosen. */
  #follow() {
    this.#whole.disabled = this.#corners.isWhole;
    this.#applyUsual();
    this.#showSize();
    this.#schedulePreview();
  }

  #showSize() {
    const has = this.#widthMm > 0 && this.#usual !== "unknown";
    this.#width.value = has ? formatLength(this.#widthMm, this.#unit) : "";
    this.#height.value = has ? formatLength(this.#widthMm / this.#aspect, this.#unit) : "";
    this.#check();
  }

  #check() {
    part("#size-unknown").hidden = this.#usual !== "unknown";
    check("usual", this.#usual);
  }

  /** Draws the flat picture small, once before the screen shows its next frame. */
  #schedulePreview() {
    cancelAnimationFrame(this.#previewing);
    this.#previewing = requestAnimationFrame(() => this.#pixels && this.#drawFlat(this.#preview, PREVIEW_LENGTH * Math.min(2, devicePixelRatio)));
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {number} length of its longer side, pixels
   */
  #drawFlat(canvas, length) {
    const pixels = /** @type {ImageData} */ (this.#pixels);
    const aspect = this.#aspect;
    const [width, height] = [length * Math.min(1, aspect), length * Math.min(1, 1 / aspect)].map((side) => Math.max(1, Math.round(side)));
    [canvas.width, canvas.height] = [width, height];
    const context = contextOf(canvas);
    // Browsers shrink well and fast what is only shrunk.
    if (this.#corners.isWhole) context.drawImage(this.#corners.picture, 0, 0, width, height);
    else context.putImageData(rectifyPicture(pixels, this.#corners.corners, width, height), 0, 0);
  }

  /** @param {"camera" | "image"} use */
  #finish(use) {
    if (!this.#pixels) return;
    const [widthMm, heightMm] = [this.#widthMm, this.#widthMm / this.#aspect];
    if (!(widthMm > 0)) return this.#refuse("How wide is the print? Choose a size, or measure it. If you cannot, choose “Unknown”.");
    if (![widthMm, heightMm].every(isUsableLength))
      return this.#refuse(`Prints of ${MIN_MM} mm to ${MAX_MM / 1000} m a side can be followed.`);
    const canvas = canvasOf(1, 1);
    // More pixels than along the longest side of the outline would show nothing more.
    this.#drawFlat(canvas, Math.min(MAX_PICTURE_LENGTH, Math.ceil(Math.max(...sidesOf(this.#corners.corners)))));
    this.onReady({ canvas, name: this.#name, widthMm, heightMm, hasSize: this.#usual !== "unknown" }, use);
  }

  /** @param {string} problem */
  #refuse(problem) {
    this.#say(problem);
    this.#width.focus();
  }

  /** @param {string} problem empty for none */
  #say(problem) {
    this.#problem.textContent = problem;
    this.#width.setAttribute("aria-invalid", String(problem !== ""));
  }
}

/** @param {string} name of radio buttons @param {string | null} value of the one that is chosen */
function check(name, value) {
  for (const radio of document.getElementsByName(name)) if (radio instanceof HTMLInputElement) radio.checked = radio.value === value;
}

/** @param {HTMLCanvasElement} canvas */
function pixelsOf(canvas) {
  return contextOf(canvas).getImageData(0, 0, canvas.width, canvas.height);
}

/** @returns {Unit} */
function rememberedUnit() {
  try {
    return localStorage.getItem(UNIT_KEY) === "cm" ? "cm" : "mm";
  } catch {
    return "mm";
  }
}
