// Photographing the flat print.

import { openCamera } from "deepsft";
import { rememberedCamera } from "../live/camera-switch.js";
import { part } from "../part.js";
import { pictureFrom } from "./read-picture.js";

/** @import { OpenedPicture } from "./read-picture.js" */
/** @import { Corners } from "./corner-editor.js" */

/** Where the guide's corners lie in the picture, as index.html has them: fractions of its sides from the border. */
const INSET = 0.12;
const NAME = "Photographed print";

export class Capture {
  #root = part("#capture");
  #video = part("#capture video", HTMLVideoElement);
  #guide = part("#capture .guide", SVGElement);
  #shutter = part("#capture .shutter", HTMLButtonElement);
  #leaving = new AbortController();
  /** @type {(picture: OpenedPicture, corners: Corners) => void} */
  onPicture = () => undefined;
  /** @type {(error: unknown) => void} */
  onError = () => undefined;

  constructor() {
    this.#shutter.addEventListener("click", () => void this.#take());
    this.#video.addEventListener("resize", () => this.#guide.setAttribute("viewBox", `0 0 ${this.#video.videoWidth} ${this.#video.videoHeight}`));
  }

  async open() {
    this.close();
    const { signal } = (this.#leaving = new AbortController());
    this.#root.hidden = false;
    this.#root.dataset.ready = "false";
    this.#shutter.disabled = true;
    try {
      const choice = rememberedCamera();
      // One looks at the print, not at the person.
      const stream = await openCamera(this.#video, { ...(choice.facing === "user" ? {} : choice), signal });
      // What stands still is not what the print looks like now.
      const follow = () => (this.#shutter.disabled = stream.interrupted);
      for (const event of ["interrupted", "resumed"]) stream.addEventListener(event, follow);
      stream.addEventListener("lost", () => this.#fail(stream.error));
      this.#root.dataset.ready = "true";
      follow();
      this.#shutter.focus();
    } catch (error) {
      if (!signal.aborted) this.#fail(error);
    }
  }

  close() {
    this.#leaving.abort();
    this.#root.hidden = true;
  }

  /** @param {unknown} error */
  #fail(error) {
    this.close();
    this.onError(error);
  }

  async #take() {
    this.#shutter.disabled = true;
    const { videoWidth: width, videoHeight: height } = this.#video;
    try {
      const picture = pictureFrom(this.#video, width, height, NAME);
      this.close();
      const [x, y] = [picture.canvas.width, picture.canvas.height];
      const [left, right, top, bottom] = [INSET * x, (1 - INSET) * x, INSET * y, (1 - INSET) * y];
      this.onPicture(picture, [[left, top], [right, top], [right, bottom], [left, bottom]]);
    } catch (error) {
      this.#fail(error);
    }
  }
}
