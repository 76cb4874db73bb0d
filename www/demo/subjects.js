// What the page looks for: the poster, flat or as a tube, by the networks that were trained for them, or a picture, by its features.

import { DeepSft } from "deepsft";
import { VERSION } from "./offline/version.js";

/** @import { LoadProgress, Target } from "deepsft" */
/** @import { ReadyPicture } from "./own/picture-editor.js" */

/**
 * A flat picture with its size, here or at an address.
 *
 * @typedef {Pick<ReadyPicture, "name" | "widthMm" | "hasSize"> & { canvas: HTMLCanvasElement | string }} SoughtPicture
 */

/**
 * @typedef {object} Subject
 * @property {"poster" | "tube" | "picture"} kind
 * @property {DeepSft} sft
 * @property {Target} target
 * @property {boolean} hasSize whether the target's size is that of the print, or made up
 */

/** Models of what comes with the page. */
const MODELS = { poster: "models/poster-a4/", tube: "models/paper-tube/" };

/** What the clip shows, as large as a picture is looked at. Its features are enough: the model is fifteen times as large. @type {SoughtPicture} */
const CLIP_PICTURE = { canvas: "demo/poster.webp", name: "poster-a4", widthMm: 297, hasSize: true };

/** @typedef {keyof typeof MODELS} Ours */

/** `?device=webgpu` or `?device=cpu` forces a device; `?model=` names a model of this server for the poster, in the clip too. */
const parameters = new URLSearchParams(location.search);

export class Subjects {
  #onProgress;
  #onLearning;
  /** Engines by the model they were loaded with; "" for none. @type {Map<string, Promise<DeepSft>>} */
  #engines = new Map();
  /** The first of them that was there. @type {DeepSft | null} */
  #loaded = null;
  /** What is looked for next. @type {SoughtPicture | Ours} */
  chosen = "poster";
  /** The picture that an engine knows. @type {{ picture: SoughtPicture, subject: Promise<Subject> } | null} */
  #known = null;

  /**
   * @param {(progress: LoadProgress) => void} onProgress while an engine loads
   * @param {() => void} onLearning when a picture is about to be learned
   */
  constructor(onProgress, onLearning) {
    this.#onProgress = onProgress;
    this.#onLearning = onLearning;
  }

  get kind() {
    return typeof this.chosen === "string" ? this.chosen : "picture";
  }

  /** Whether it is the person's own picture. */
  get isOwn() {
    return this.kind === "picture" && this.chosen !== CLIP_PICTURE;
  }

  /** What the clip shows. */
  chooseClip() {
    this.chosen = parameters.has("model") ? "poster" : CLIP_PICTURE;
  }

  /** What was chosen, once an engine knows it. */
  async ready() {
    const chosen = this.chosen;
    if (typeof chosen === "string") {
      const sft = await this.#engine((chosen === "poster" && parameters.get("model")) || MODELS[chosen]);
      // The model's own target comes first.
      return { kind: chosen, sft, target: sft.targets[0], hasSize: true };
    }
    if (this.#known?.picture !== chosen) {
      const before = this.#known?.subject;
      this.#known = { picture: chosen, subject: this.#learn(chosen, before) };
      this.#known.subject.catch(() => this.#known?.picture === chosen && (this.#known = null));
    }
    return this.#known.subject;
  }

  /**
   * Reads a scan with the engine that is there, or with one that has no model.
   *
   * @param {File[]} files
   */
  async readScan(files) {
    return (await this.#anyEngine()).readScan(files);
  }

  /** One engine does for all, if one is there already. One that still loads a model, or fails to, is not waited for. */
  async #anyEngine() {
    return this.#loaded ?? this.#engine("");
  }

  /**
   * @param {SoughtPicture} picture
   * @param {Promise<Subject> | undefined} before the picture that it takes the place of
   * @returns {Promise<Subject>}
   */
  async #learn(picture, before) {
    const { canvas, name, widthMm, hasSize } = picture;
    const old = await before?.catch(() => undefined);
    old?.sft.removeTarget(old.target);
    const sft = await this.#anyEngine();
    if (this.chosen === picture) this.#onLearning();
    return { kind: "picture", sft, target: await sft.addPicture(canvas, { widthMm, name }), hasSize };
  }

  /**
   * An engine, loaded once; a failure is forgotten so that it can be tried again.
   *
   * @param {string} model
   */
  #engine(model) {
    const known = this.#engines.get(model);
    if (known) return known;
    // The site's service worker keeps our own already.
    const keep = VERSION === null || model !== MODELS.poster;
    const wanted = parameters.get("device");
    const device = wanted === "webgpu" || wanted === "cpu" ? wanted : "auto";
    const loading = DeepSft.load(model === "" ? undefined : model, { device, keep, onProgress: this.#onProgress });
    this.#engines.set(model, loading);
    loading.then(
      (sft) => (this.#loaded ??= sft),
      () => this.#engines.delete(model),
    );
    return loading;
  }
}
