// The buttons that take a picture of what is seen, or record it.

import { Recording, pictureOf, recordingCanvas, recordingKind, shareFile } from "deepsft";
import { drawScene } from "./shots.js";

/** @import { Scene } from "./shots.js" */

export class ShotButtons {
  #record;
  #time;
  #scene;
  #fail;
  /** @type {{ canvas: HTMLCanvasElement, recording: Recording } | null} */
  #running = null;

  /**
   * @param {HTMLElement} group with the two buttons
   * @param {() => Scene} scene draws what is seen anew
   * @param {(error: unknown) => void} fail is told what went wrong
   */
  constructor(group, scene, fail) {
    const [picture, record] = group.querySelectorAll("button");
    this.#record = record;
    this.#time = /** @type {HTMLElement} */ (record.querySelector(".time"));
    this.#scene = scene;
    this.#fail = fail;
    record.hidden = recordingKind === undefined;
    picture.addEventListener("click", () => this.#try(async () => shareFile(await this.#picture(), nameNow())));
    record.addEventListener("click", () => (this.#running ? this.stop() : this.#try(() => this.#run())));
  }

  /** Adds what has just been drawn, where it is recorded. @param {() => Scene} scene */
  add(scene) {
    if (this.#running) drawScene(this.#running.canvas, scene());
  }

  /** Ends a recording; what was recorded is handed to the person. */
  stop() {
    // What becomes of it is told where it was begun.
    this.#running?.recording.stop().catch(() => undefined);
  }

  #picture() {
    const scene = this.#scene();
    return pictureOf(drawScene(recordingCanvas(scene.area), scene));
  }

  async #run() {
    const scene = this.#scene();
    const canvas = drawScene(recordingCanvas(scene.area), scene);
    const recording = new Recording(canvas);
    this.#running = { canvas, recording };
    const began = performance.now();
    const name = nameNow();
    const tell = () => {
      const seconds = Math.floor((performance.now() - began) / 1000);
      this.#time.textContent = `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
    };
    tell();
    const clock = setInterval(tell, 1000);
    this.#show(true);
    try {
      await shareFile(await recording.finished, name);
    } finally {
      clearInterval(clock);
      this.#running = null;
      this.#show(false);
    }
  }

  /** @param {boolean} recording */
  #show(recording) {
    this.#record.dataset.recording = String(recording);
    this.#record.setAttribute("aria-label", recording ? "End the recording" : "Record a video");
    this.#time.hidden = !recording;
  }

  /** @param {() => Promise<void>} work */
  #try(work) {
    work().catch(this.#fail);
  }
}

function nameNow() {
  return `deepsft ${new Date().toISOString().slice(0, 19).replace("T", " ").replaceAll(":", "-")}`;
}
