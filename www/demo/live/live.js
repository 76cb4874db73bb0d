// The live view: frames in, overlay out.

import { DeepSftError } from "deepsft";
import { MaskCovering, PrintCovering, TemplateLight, confirmed, seenFractions } from "deepsft/light";
import { animate, prefersStillness } from "../graphics/animation.js";
import { depthRange, depthTicks } from "../graphics/heat.js";
import { shadingOf, tintOf } from "../stage/shading.js";

/** @import { Estimate, Session, SourcedCamera, SurfaceMesh, TrackedFrame } from "deepsft" */
/** @import { Hud } from "./hud.js" */
/** @import { VideoSource } from "../sources.js" */
/** @import { Subject } from "../subjects.js" */
/** @import { Orbit } from "../graphics/orbit.js" */
/** @import { PlainStage } from "../stage/plain-stage.js" */
/** @import { Stage } from "../stage/stage.js" */

/** So long after the network saw the sheet its maps are shown where the tracker has no mesh (yet), milliseconds. */
const MAPS_SHOWN_MS = 1500;
/** Where the processor draws, only when it has seen it for so long: the tracker's mesh is there sooner than a drawing of the maps. */
const MAPS_SOFTWARE_MS = 800;
/** A picture that was not followed for so long counts as not found, milliseconds. */
const MISSING_MS = 2500;
/** Seconds in which the depth scale follows the sheet most of the way. */
const SCALE_SECONDS = 0.4;
/** Canvas pixels per CSS pixel, at least, on slow machines. */
const MIN_QUALITY = 0.5;
/** An answer tells what covers the sheet only where the image confirms the mesh of its frame so far. */
const MIN_CORRELATION = 0.6;

/** Fired on the document for each estimate, before it is closed, for those who script the page. */
export class EstimateEvent extends Event {
  /** @param {Estimate} estimate */
  constructor(estimate) {
    super("deepsft-estimate");
    this.estimate = estimate;
  }
}

/** Fired on the document for each tracked frame, before it is closed, for those who script the page. */
export class TrackedEvent extends Event {
  /** @param {TrackedFrame} tracked */
  constructor(tracked) {
    super("deepsft-tracked");
    this.tracked = tracked;
  }
}

export class Live {
  #stage;
  #hud;
  #orbit;
  #region;
  /** @type {Subject | null} */
  #subject = null;
  /** @type {TemplateLight | null} */
  #templateLight = null;
  /** @type {Session | null} */
  #session = null;
  #covering = new MaskCovering();
  /** Of a picture, which has no mask. @type {PrintCovering | null} */
  #printCovering = null;
  /** @type {SurfaceMesh | null} the one that is drawn */
  #mesh = null;
  /** Whether the tracker had the sheet in its last frame. */
  #tracked = false;
  #networkFps = 0;
  /** When the tracker last had the sheet, or began to look for it, milliseconds. */
  #trackedAt = -Infinity;
  /** When the network last saw the sheet, milliseconds. */
  #seenAt = -Infinity;
  /** Since when it has seen the sheet that the tracker does not have, milliseconds. */
  #seenSince = -Infinity;
  /** @type {{ near: number, far: number } | null} */
  #range = null;
  #scaledAt = 0;
  /** @type {() => void} */
  #stopAnimation = () => undefined;
  /** @type {(estimate: Estimate) => void} */
  onEstimate = () => undefined;
  /** @type {(tracked: TrackedFrame) => void} told of each frame of a video before it is closed */
  onFrame = () => undefined;
  /** @type {() => void} called when the stage has just been drawn */
  onDraw = () => undefined;
  /** @type {(mesh: SurfaceMesh | null, camera: SourcedCamera, atOnce: boolean) => void} told of the newest mesh */
  onMesh = () => undefined;

  /**
   * @param {Stage | PlainStage} stage
   * @param {Hud} hud
   * @param {Orbit | null} orbit the sheet from the side, where it can be drawn
   * @param {HTMLElement} region frame around the part of the picture that the network sees
   */
  constructor(stage, hud, orbit, region) {
    this.#stage = stage;
    this.#hud = hud;
    this.#orbit = orbit;
    this.#region = region;
  }

  /** @param {Subject} subject what is looked for */
  use(subject) {
    this.#subject = subject;
    const { target } = subject;
    this.#templateLight = new TemplateLight(target.texture);
    this.#stage.tint = [1, 1, 1];
    this.#printCovering = subject.kind === "picture" ? new PrintCovering(target) : null;
    this.#stage.setTemplate(target, this.#templateLight);
    this.#orbit?.setTemplate(target);
    this.#hud.showSubject(subject);
  }

  /**
   * Follows a video until stopped.
   *
   * @param {HTMLVideoElement} video
   * @param {VideoSource} source that plays in it
   * @returns {Promise<void>} rejects when something ends it
   */
  async follow(video, { stream, camera }) {
    const { sft, target } = this.#started();
    this.#animate();
    this.#trackedAt = performance.now();
    this.#session = sft.follow(stream ?? video, {
      targets: [target],
      camera,
      software: this.#stage.software,
      onEstimate: (estimate, frame) => this.#takeAnswer(estimate, frame),
    });
    for await (const tracked of this.#session) this.#takeTracked(tracked);
  }

  /**
   * Shows one picture: at first with the maps of what was found, then with the mesh that was fitted to it.
   *
   * @param {Blob} image
   * @param {() => boolean} wanted whether it still is, once it is there
   */
  async show(image, wanted) {
    const { sft, target } = this.#started();
    const estimate = await sft.estimate(image, { target });
    if (!wanted()) return estimate.close();
    this.#animate();
    const began = performance.now();
    this.#take(estimate);
    this.#hud.showEstimate(estimate, performance.now() - began);
    const whole = estimate.found || target.kind === "model" ? estimate.completeMesh() : null;
    const { width, height } = estimate.mask;
    const seen = estimate.mask.values();
    const { camera, focal } = estimate;
    estimate.close();
    const mesh = await whole;
    if (!mesh || !wanted()) return;
    this.#followDepth(depthsOf(mesh));
    const mask = { width, height, values: () => seen };
    this.#stage.addMesh(mesh, confirmed(seenFractions(mesh, { mask, focal }), mesh.confidence));
    this.#hud.showMesh(true);
    this.onMesh(mesh, camera, true);
    this.#mesh = mesh;
    this.redraw();
  }

  /** Ends what goes on and clears the stage. */
  stop() {
    this.#session?.close();
    this.#session = null;
    this.#stopAnimation();
    this.#stage.animated = false;
    this.#stage.clear();
    this.#covering.reset();
    this.#printCovering?.reset();
    this.#orbit?.reset();
    this.#mesh = null;
    [this.#tracked, this.#trackedAt, this.#seenAt] = [false, -Infinity, -Infinity];
    this.#range = null;
    this.#region.hidden = true;
    this.#stage.draw(0);
  }

  /** Draws what has changed: the frame, the overlay or the window. */
  redraw() {
    // What asks for the page's layout comes before what changes it.
    if (this.#mesh) this.#orbit?.show(this.#mesh);
    this.#placeRegion();
    // An animated stage is drawn with the next frame of the screen anyway.
    if (!this.#stage.animated) this.draw();
    if (this.#stage.overlay === "depth" && this.#range) this.#hud.showDepthScale(this.#range);
  }

  /** Draws the stage as it is. @param {number} [seconds] for papers that move */
  draw(seconds = performance.now() / 1000) {
    this.#stage.draw(seconds);
    this.onDraw();
  }

  #started() {
    if (!this.#subject) throw new DeepSftError("internal", "The live view was started with nothing to look for.");
    return this.#subject;
  }

  /**
   * Draws a frame of the video as the tracker sees it, or leaves it to the network's maps.
   *
   * @param {TrackedFrame} tracked
   */
  #takeTracked(tracked) {
    const began = performance.now();
    document.dispatchEvent(new TrackedEvent(tracked));
    const { mesh } = tracked;
    this.#tracked = mesh !== null;
    if (mesh) this.#trackedAt = began;
    /** @type {Float32Array} */
    let seen = new Float32Array();
    if (mesh) {
      const certain = tracked.correlation >= MIN_CORRELATION;
      seen = this.#printCovering?.follow(mesh, certain) ?? this.#covering.follow(tracked.number, mesh, certain);
      this.#followDepth(depthsOf(mesh));
    }
    if (!this.#mapsAreShown()) {
      this.#stage.showMesh(tracked, mesh, seen);
      this.#mesh = mesh;
      this.redraw();
    }
    this.#hud.showTracked(tracked, performance.now() - began);
    this.#networkFps = tracked.networkFps;
    // A network says by itself that nothing is there.
    if (this.#started().kind === "picture" && began - this.#trackedAt > MISSING_MS) this.#hud.showMissing();
    this.onMesh(mesh, tracked.camera, false);
    this.onFrame(tracked);
  }

  /**
   * @param {Estimate} estimate
   * @param {number} frame its number
   */
  #takeAnswer(estimate, frame) {
    const now = performance.now();
    if (this.#tracked || now - this.#seenAt >= MAPS_SHOWN_MS) this.#seenSince = now;
    if (estimate.found) this.#seenAt = now;
    this.#covering.answer(frame, estimate);
    this.#take(estimate);
    this.#hud.showAnswer(estimate, this.#tracked, this.#networkFps);
    estimate.close();
  }

  /** Whether frames are drawn as the network answers them: for its mask, and where the tracker has no mesh yet. */
  #mapsAreShown() {
    if (this.#started().kind === "picture") return false;
    if (this.#stage.overlay === "mask") return true;
    const now = performance.now();
    const isDue = !this.#stage.software || now - this.#seenSince >= MAPS_SOFTWARE_MS;
    return isDue && !this.#tracked && now - this.#seenAt < MAPS_SHOWN_MS;
  }

  /**
   * Draws what the network says of a frame, unless the tracker draws.
   *
   * @param {Estimate} estimate
   */
  #take(estimate) {
    document.dispatchEvent(new EstimateEvent(estimate));
    this.onEstimate(estimate);
    // After a lost GPU the engine may run elsewhere.
    this.#hud.showEngine(this.#started());
    const draws = this.#session === null || this.#mapsAreShown();
    let shading = null;
    if (estimate.found && this.#templateLight) {
      /** @type {Parameters<typeof shadingOf>} */
      const lit = [estimate.canonical, estimate.registration.values(), estimate.mask.values(), this.#templateLight];
      this.#stage.tint = tintOf(...lit);
      // The tracker's mesh has its own light.
      if (draws) {
        shading = shadingOf(...lit);
        this.#followDepth(estimate.depth.values());
      }
    }
    if (!draws) return;
    this.#stage.showMaps(estimate, shading);
    this.#mesh = null;
    this.redraw();
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
  }

  /**
   * Draws at the screen's rate, so that the papers move. A machine that does not keep up, or has no GPU, draws only new
   * results, and coarser.
   */
  #animate() {
    this.#stopAnimation();
    this.#hud.showSoftware(this.#stage.software);
    this.#stage.animated = !this.#stage.software && !prefersStillness();
    if (!this.#stage.animated) return;
    const draw = (/** @type {number} */ seconds) => {
      this.draw(seconds);
      return this.#stage.busy;
    };
    this.#stopAnimation = animate(draw, (slowness) => {
      this.#stage.animated = false;
      this.#stage.quality = Math.max(MIN_QUALITY, Math.sqrt(1 / slowness));
      this.redraw();
    });
  }

  #placeRegion() {
    const place = this.#stage.regionOnCanvas();
    this.#region.hidden = !place?.partial;
    if (!place?.partial) return;
    for (const side of /** @type {const} */ (["left", "top", "width", "height"]))
      this.#region.style[side] = `${place[side]}px`;
  }
}

/** @param {SurfaceMesh} mesh */
function depthsOf({ vertices }) {
  return vertices.filter((_, i) => i % 3 === 2);
}
