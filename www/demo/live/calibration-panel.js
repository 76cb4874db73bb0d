// Calibrating the camera with the poster itself: hold it flat, tilt it about.

import { FocalCalibration } from "deepsft";

/** @import { CameraStream, Estimate } from "deepsft" */

/** A calibration that contradicts itself by more than this fraction of the focal length is not kept. */
const MAX_SPREAD = 0.06;

/** What a person does about each verdict. */
const ADVICE = {
  taken: "Good. Now tilt it another way.",
  "not-found": "Show the whole sheet.",
  "not-flat": "Hold it flat, on a book or a board.",
  "not-tilted": "Tilt it more, away from the camera.",
  "too-similar": "Tilt it another way: left, right, up, down.",
};

export class CalibrationPanel {
  /** @type {FocalCalibration | null} */
  #calibration = null;
  /** @type {CameraStream | null} */
  #camera = null;
  #size = { width: 0, height: 0 };
  #panel;

  /** @param {HTMLElement} panel */
  constructor(panel) {
    this.#panel = panel;
    this.#part("end").addEventListener("click", () => this.stop());
  }

  /** Whether frames are being gathered. */
  get active() {
    return this.#calibration !== null;
  }

  /**
   * @param {CameraStream} camera
   * @param {{ widthMm: number, heightMm: number }} template
   */
  start(camera, template) {
    this.#calibration = new FocalCalibration(template);
    this.#camera = camera;
    this.#size = { width: 0, height: 0 };
    this.#say("Hold the sheet flat and tilt it", "Eight different tilts make a calibration.");
    this.#panel.hidden = false;
    this.#showProgress();
  }

  /** Looks at a frame while active. @param {Estimate} estimate */
  add(estimate) {
    if (!this.#calibration || !this.#camera) return;
    const { width, height } = estimate.camera;
    if (this.#size.width === 0) this.#size = { width, height };
    // Turned in the middle: the views so far were of other images.
    if (this.#size.width !== width) return this.stop();
    const verdict = this.#calibration.add(estimate);
    this.#say("Hold the sheet flat and tilt it", ADVICE[verdict]);
    this.#showProgress();
    if (this.#calibration.taken === this.#calibration.wanted) this.#finish(this.#calibration, this.#camera);
  }

  stop() {
    this.#calibration = null;
    this.#panel.hidden = true;
  }

  /**
   * @param {FocalCalibration} calibration
   * @param {CameraStream} camera
   */
  #finish(calibration, camera) {
    const result = calibration.result();
    this.#calibration = null;
    if (!result || result.spread > MAX_SPREAD * result.focal) {
      this.#say(
        "The calibration failed",
        "The views contradict each other. Keep the sheet flat, in even light, and try again.",
      );
      return;
    }
    const { width, height } = this.#size;
    const isKept = camera.calibrate(width, height, result.focal, result.spread);
    const found = `f = ${result.focal.toFixed(0)} ± ${result.spread.toFixed(0)} px`;
    this.#say("Calibrated", isKept ? `${found}, kept in this browser.` : `${found}. What is kept already is surer; forget that first.`);
  }

  #showProgress() {
    const { taken = 0, wanted = 0 } = this.#calibration ?? {};
    const dots = Array.from({ length: wanted }, (_, i) => {
      const dot = document.createElement("i");
      dot.dataset.taken = String(i < taken);
      return dot;
    });
    this.#part("dots").replaceChildren(...dots);
  }

  /**
   * @param {string} title
   * @param {string} text
   */
  #say(title, text) {
    this.#part("title").textContent = title;
    this.#part("text").textContent = text;
  }

  /** @param {string} name */
  #part(name) {
    const part = this.#panel.querySelector(`#calibration-${name}`);
    if (!(part instanceof HTMLElement)) throw new Error(`The page has no calibration-${name}.`);
    return part;
  }
}
