// The live view: frames in, overlay out.

import { DeepSftError } from "deepsft";
import { animate, prefersStillness } from "./animation.js";
import { depthRange, depthTicks } from "./heat.js";
import { TemplateLight, shadingOf } from "./shading.js";

/** @import { CameraOption, DeepSft, Estimate, Tracking } from "deepsft" */
/** @import { Hud } from "./hud.js" */
/** @import { Stage } from "./stage.js" */

/** Seconds in which the depth scale follows the sheet most of the way. */
const SCALE_SECONDS = 0.4;
/** Canvas pixels a CSS pixel: the fewest on slow machines, and those where the processor draws. */
const LEAST_QUALITY = 0.5;
const SOFTWARE_QUALITY = 0.7;

/** Fired on the document for each estimate, before it is closed, for those who script the page. */
export class EstimateEvent extends Event {
  /** @param {Estimate} estimate */
  constructor(estimate) {
    super("deepsft-estimate");
    this.estimate = estimate;
  }
}

export class Live {
  #stage;
  #hud;
  #region;
  /** @type {DeepSft | null} */
  #sft = null;
  /** @type {TemplateLight | null} */
  #templateLight = null;
  /** @type {Tracking | null} */
  #tracking = null;
  /** @type {{ near: number, far: number } | null} */
  #range = null;
  #scaledAt = 0;
  /** @type {() => void} */
  #stopAnimation = () => undefined;
  /** @type {(estimate: Estimate) => void} */
  onEstimate = () => undefined;

  /**
   * @param {Stage} stage
   * @param {Hud} hud
   * @param {HTMLElement} region frame around the part of the picture that the network sees
   */
  constructor(stage, hud, region) {
    this.#stage = stage;
    this.#hud = hud;
    this.#region = region;
  }

  /** @param {DeepSft} sft */
  use(sft) {
    this.#sft = sft;
    const template = sft.template;
    this.#templateLight = new TemplateLight(template.texture);
    this.#stage.setSheet(template);
  }

  /**
   * Follows a video until stopped.
   *
   * @param {HTMLVideoElement} video
   * @param {CameraOption | undefined} camera
   * @returns {Promise<void>} rejects when something ends it
   */
  async follow(video, camera) {
    const sft = this.#started();
    this.#animate();
    this.#tracking = sft.track(video, (estimate) => this.#take(estimate), { camera });
    await this.#tracking.finished;
  }

  /**
   * Shows one picture.
   *
   * @param {Blob} image
   * @param {() => boolean} wanted whether it still is, once it is there
   */
  async show(image, wanted) {
    const estimate = await this.#started().estimate(image);
    if (!wanted()) return estimate.close();
    this.#animate();
    this.#take(estimate);
  }

  /** Ends what goes on and clears the stage. */
  stop() {
    this.#tracking?.stop();
    this.#tracking = null;
    this.#stopAnimation();
    this.#stage.clear();
    this.#range = null;
    this.#region.hidden = true;
    this.#stage.draw(0);
  }

  /** Draws again, after the window or the overlay changed. */
  redraw() {
    this.#stage.draw(performance.now() / 1000);
    this.#placeRegion();
  }

  #started() {
    if (!this.#sft) throw new DeepSftError("internal", "The live view was started without an estimator.");
    return this.#sft;
  }

  /** @param {Estimate} estimate */
  #take(estimate) {
    const began = performance.now();
    document.dispatchEvent(new EstimateEvent(estimate));
    this.onEstimate(estimate);
    let light = null;
    if (estimate.found && this.#templateLight) {
      const [registration, mask] = [estimate.registration.values(), estimate.mask.values()];
      light = shadingOf(estimate.canonical.data, registration, mask, this.#templateLight);
      this.#followDepth(estimate.depth.values());
    }
    // After a lost GPU the engine may run elsewhere.
    this.#hud.showEngine(this.#started().info);
    this.#stage.show(estimate, light);
    this.redraw();
    this.#hud.showFrame(estimate, performance.now() - began);
    estimate.close();
  }

  /** @param {Float32Array} depth */
  #followDepth(depth) {
    const seen = depthRange(depth);
    if (!seen) return;
    const last = this.#range ?? seen;
    const now = performance.now() / 1000;
    const pace = 1 - Math.exp((this.#scaledAt - now) / SCALE_SECONDS);
    this.#scaledAt = now;
    const ease = (/** @type {"near" | "far"} */ end) => last[end] + pace * (seen[end] - last[end]);
    this.#range = { near: ease("near"), far: ease("far") };
    const { step } = depthTicks(this.#range, 9);
    this.#stage.depthScale = { ...this.#range, step };
    this.#hud.showDepthScale(this.#range);
  }

  /**
   * Draws at the screen's rate, so that the papers move. A machine that does not keep up, or has no GPU, draws only new
   * results, and coarser.
   */
  #animate() {
    this.#stopAnimation();
    if (this.#stage.software) this.#stage.quality = SOFTWARE_QUALITY;
    this.#stage.animated = !this.#stage.software && !prefersStillness();
    if (!this.#stage.animated) return;
    const draw = (/** @type {number} */ seconds) => {
      this.#stage.draw(seconds);
      return this.#stage.busy;
    };
    this.#stopAnimation = animate(draw, (slowness) => {
      this.#stage.animated = false;
      this.#stage.quality = Math.max(LEAST_QUALITY, Math.sqrt(1 / slowness));
    });
  }

  #placeRegion() {
    const place = this.#stage.regionOnCanvas();
    this.#region.hidden = !place?.partial;
    if (!place) return;
    for (const side of /** @type {const} */ (["left", "top", "width", "height"]))
      this.#region.style[side] = `${place[side]}px`;
  }
}
