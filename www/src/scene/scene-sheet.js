// A print in a scene: what is printed on it instead, and what stands on it.

import { Sheet } from "../three/sheet.js";
import { printOf } from "./print.js";

/** @import { FlatPrint, FlattenOptions, Target } from "../index.js" */
/** @import { Print, PrintInput } from "./print.js" */

/** A tracked print in a scene. {@link Sheet} of `deepsft/three` has anchors and the light. */
export class SceneSheet extends Sheet {
  #place;
  #signal;
  #flatten;
  /** @type {Print | null} */
  #print = null;
  /** Ends what is opened to be printed. */
  #opening = new AbortController();

  /**
   * Use `view.sheet`.
   *
   * @param {Target} target
   * @param {{ light: boolean, place: HTMLElement, signal: AbortSignal, flatten: (options: FlattenOptions) => Promise<FlatPrint | null> }} options
   *   where its films lie in the page, what ends them, and what lays it flat
   */
  constructor(target, { light, place, signal, flatten }) {
    super(target, { light });
    this.#place = place;
    this.#signal = signal;
    this.#flatten = flatten;
    signal.addEventListener("abort", () => {
      this.#opening.abort(signal.reason);
      this.#close();
    });
  }

  /**
   * Prints something in the print's place, lit as its paper is; what lies before the paper covers it. Films play inline, muted, again and
   * again, while the print is found.
   *
   * @param {PrintInput | null} input null for the print as it is
   * @returns {Promise<void>} once it is there; a later call takes its place
   * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`; once another was wanted, the signal's reason
   */
  async print(input) {
    this.#signal.throwIfAborted();
    this.#opening.abort(new DOMException("Something else is printed.", "AbortError"));
    const { signal } = (this.#opening = new AbortController());
    const print = input === null ? null : await printOf(input, this.#place, signal);
    if (signal.aborted) print?.close();
    signal.throwIfAborted();
    this.#close();
    this.#print = print;
    this.map = print?.texture ?? null;
    this.playFilm();
  }

  /**
   * Lays the print flat as the camera's newest picture shows it, without what the scene puts on it: for forms, labels, colouring books.
   *
   * @param {Pick<FlattenOptions, "width" | "unshaded" | "signal">} [options]
   * @returns {Promise<FlatPrint | null>} null where it is not found
   * @throws {DeepSftError} as `sft.flatten`
   */
  flatten(options = {}) {
    return this.#flatten(options);
  }

  /** The film that is printed on it; null for none. */
  get video() {
    return this.#print?.film ?? null;
  }

  /** Plays the film while the print is found, else pauses it. */
  playFilm() {
    const film = this.video;
    if (!film) return;
    if (!this.visible) film.pause();
    // Where it may not yet, a tap on the scene plays it.
    else if (film.paused) film.play().catch(() => undefined);
  }

  /** A canvas may show something else by now; the view calls it before it draws. */
  refreshPrint() {
    if (this.#print?.isLive) this.#print.texture.needsUpdate = true;
  }

  #close() {
    this.map = null;
    this.#print?.close();
    this.#print = null;
  }
}
