// The buttons that take a picture of what is seen, or record it.

import { recordingKind, shareFile } from "deepsft";
import { part } from "../part.js";

/** @import { Recording } from "deepsft" */
/** @import { SceneView } from "deepsft/scene" */

export class ShotButtons {
  #record = part("#record", HTMLButtonElement);
  #time = part("#record .time");
  #view;
  #fail;
  /** @type {Recording | null} */
  #recording = null;

  /**
   * @param {() => SceneView | null} view that is shown
   * @param {(error: unknown) => void} fail is told what went wrong
   */
  constructor(view, fail) {
    this.#view = view;
    this.#fail = fail;
    this.#record.hidden = recordingKind === undefined;
    part("#take").addEventListener("click", () => this.#try(async (view) => shareFile(await view.shot(), nameNow())));
    this.#record.addEventListener("click", () => (this.#recording ? this.stop() : this.#try((view) => this.#run(view))));
  }

  /** Ends a recording; what was recorded is handed to the person. */
  stop() {
    // What becomes of it is told where it was begun.
    this.#recording?.stop().catch(() => undefined);
  }

  /** @param {SceneView} view */
  async #run(view) {
    const recording = (this.#recording = view.record());
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
      this.#recording = null;
      this.#show(false);
    }
  }

  /** @param {boolean} recording */
  #show(recording) {
    this.#record.dataset.recording = String(recording);
    this.#record.setAttribute("aria-label", recording ? "End the recording" : "Record a video");
    this.#time.hidden = !recording;
  }

  /** @param {(view: SceneView) => Promise<void>} work */
  #try(work) {
    const view = this.#view();
    if (view) work(view).catch(this.#fail);
  }
}

function nameNow() {
  return `deepsft ${new Date().toISOString().slice(0, 19).replace("T", " ").replaceAll(":", "-")}`;
}
