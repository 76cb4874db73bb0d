// Photographing the flat print.

import { openCamera } from "deepsft";
import { rememberedCamera } from "../live/camera-switch.js";
import { part } from "../part.js";
import { pictureFrom } from "./read-picture.js";

/** @import { OpenedPicture } from "./read-picture.js" */
/** @import { Corners } from "./corner-editor.js" */

/** Where the guide's corners lie in the picture, as fractions of its sides from the border: where the print's will be, nearly. */
const INSET = 0.12;
const NAME = "Photographed print";

export class Capture {
  #root = part("#capture");
  #video = part("#capture video", HTMLVideoElement);
  #guide = part("#capture .guide");
  #shutter = part("#capture .shutter", HTMLButtonElement);
  #leaving = new AbortController();
  /** @type {(picture: OpenedPicture, corners: Corners) => void} */
  onPicture = () => undefined;
  /** @type {(error: unknown) => void} */
  onError = () => undefined;

  constructor() {
    this.#shutter.addEventListener("click", () => void this.#take());
    new ResizeObserver(() => this.#place()).observe(this.#root);
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
      stream.addEventListener("resize", () => this.#place());
      // What stands still is not what the print looks like now.
      const follow = () => (this.#shutter.disabled = stream.interrupted);
      for (const event of ["interrupted", "resumed"]) stream.addEventListener(event, follow);
      stream.addEventListener("lost", () => this.#fail(stream.error));
      this.#place();
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
      this.onPicture(picture, guideOf(picture.canvas));
    } catch (error) {
      this.#fail(error);
    }
  }

  /** Lays the guide over the video's picture, which keeps its proportions. */
  #place() {
    const { clientWidth, clientHeight, videoWidth, videoHeight } = this.#video;
    if (!videoWidth || !clientWidth) return;
    const scale = Math.min(clientWidth / videoWidth, clientHeight / videoHeight);
    const [width, height] = [videoWidth * scale, videoHeight * scale];
    const guide = this.#guide.style;
    guide.left = `${(clientWidth - width) / 2 + INSET * width}px`;
    guide.top = `${(clientHeight - height) / 2 + INSET * height}px`;
    guide.width = `${(1 - 2 * INSET) * width}px`;
    guide.height = `${(1 - 2 * INSET) * height}px`;
  }
}

/**
 * @param {{ width: number, height: number }} picture
 * @returns {Corners}
 */
function guideOf({ width, height }) {
  const [left, right, top, bottom] = [INSET * width, (1 - INSET) * width, INSET * height, (1 - INSET) * height];
  return [[left, top], [right, top], [right, bottom], [left, bottom]]; // prettier-ignore
}
