// The live view: a scene on what is looked for, and what the page tells of each frame.

import { visibleRegion } from "deepsft";
import { start } from "deepsft/scene";
import { depthRange, depthTicks } from "../graphics/heat.js";
import { orbitOn } from "../graphics/orbit.js";
import { part } from "../part.js";
import { MeasuresPanel } from "./measures.js";
import { Overlays } from "./overlays.js";

/** @import { Estimate, SourcedCamera, SurfaceMesh, TrackedFrame } from "deepsft" */
/** @import { SceneOptions, SceneView } from "deepsft/scene" */
/** @import { Hud } from "./hud.js" */
/** @import { Choice } from "./overlays.js" */
/** @import { Subject } from "../subjects.js" */

/** The picture covers the page as far as it is then at most so much larger than all of it would be. */
const MAX_CUT = 1.12;
/** A picture that was not followed for so long counts as not found, milliseconds. */
const MISSING_MS = 2500;
/** Seconds in which the depth scale follows the sheet most of the way. */
const SCALE_SECONDS = 0.4;
/** Of the image, below which a region that the network sees is marked. */
const WHOLE = 0.95;

export class Live {
  #container = part("#stage");
  #hud;
  #choice;
  #onShown;
  /** The sheet from the side, where it can be drawn. */
  #orbit = orbitOn(part("#orbit", HTMLCanvasElement));
  /** Frame around the part of the picture that the network sees. */
  #region = part("#region");
  #measures = new MeasuresPanel();
  /** Whether one picture is shown, and no video. */
  #isPhotograph = false;
  /** The scene that is shown. @type {SceneView | null} */
  view = null;
  /** What is drawn on its sheet. @type {Overlays | null} */
  #overlays = null;
  /** @type {TrackedFrame | null} the newest */
  #frame = null;
  /** When the tracker last had the sheet, or began to look for it, milliseconds. */
  #trackedAt = -Infinity;
  /** @type {{ near: number, far: number } | null} */
  #range = null;
  #scaledAt = 0;

  /**
   * @param {Hud} hud
   * @param {Choice} choice what is drawn over the picture
   * @param {() => void} onShown is told when there is something to see
   */
  constructor(hud, choice, onShown) {
    this.#hud = hud;
    this.#choice = choice;
    this.#onShown = onShown;
  }

  /**
   * Follows a video, or shows one photograph with what is found in it, until the signal ends it.
   *
   * @param {Subject} subject what is looked for
   * @param {Pick<SceneOptions, "source" | "camera" | "photograph">} options
   * @param {AbortSignal} signal
   * @returns {Promise<void>} rejects when something else ends it
   */
  async show(subject, options, signal) {
    const { sft, target } = subject;
    this.#isPhotograph = options.photograph !== undefined;
    this.#hud.showSubject(subject);
    this.#orbit?.setTemplate(target);
    const ended = new Promise((resolve) => signal.addEventListener("abort", resolve));
    const onEstimate = (/** @type {Estimate} */ estimate) => {
      // For those who script the page, as below.
      document.dispatchEvent(Object.assign(new Event("deepsft-estimate"), { estimate }));
      this.#onShown();
      // After a lost GPU the engine may run elsewhere.
      this.#hud.showEngine(subject);
      if (this.#isPhotograph) this.#hud.showEstimate(estimate, this.view?.drawMs ?? 0);
      else this.#hud.showAnswer(estimate, this.#frame?.found ?? false, this.#frame?.networkFps ?? 0);
    };
    const shown = { sft, targets: [target], fit: MAX_CUT, screens: /** @type {const} */ (false), sound: false, smooth: false, onEstimate };
    const view = await start(this.#container, { ...shown, ...options, signal });
    this.view = view;
    this.#trackedAt = performance.now();
    // The panels then do without blurred glass.
    part("#live").dataset.software = String(view.software);
    this.#overlays = new Overlays(view, target, this.#container, signal);
    this.#overlays.show(this.#choice);
    signal.addEventListener("abort", () => this.#end());
    view.addEventListener("frame", ({ detail: { frame } }) => {
      if (frame !== this.#frame) this.#take(frame, view, subject);
      this.#overlays?.animate();
    });
    const failed = new Promise((_, reject) => view.addEventListener("error", ({ detail }) => reject(detail.error)));
    await Promise.race([ended, failed]);
  }

  /** Draws what was chosen anew. */
  refresh() {
    this.#overlays?.show(this.#choice);
    this.#showScale();
    if (this.#frame?.mesh) this.#orbit?.show(this.#frame.mesh);
  }

  #end() {
    this.#overlays?.dispose();
    [this.view, this.#overlays, this.#frame, this.#range] = [null, null, null, null];
    this.#orbit?.reset();
    this.#measures.reset();
    this.#region.hidden = true;
  }

  /**
   * Tells of a new frame, before it is drawn.
   *
   * @param {TrackedFrame} tracked
   * @param {SceneView} view
   * @param {Subject} subject
   */
  #take(tracked, view, { kind, hasSize }) {
    const now = performance.now();
    const { mesh, camera } = tracked;
    this.#frame = tracked;
    document.dispatchEvent(Object.assign(new Event("deepsft-tracked"), { tracked }));
    if (mesh) {
      this.#trackedAt = now;
      this.#followDepth(mesh);
      this.#orbit?.show(mesh);
    }
    const range = this.#range ?? { near: 0, far: 1 };
    this.#overlays?.follow(mesh, { ...range, step: depthTicks(range, 9).step });
    this.#showScale();
    this.#placeRegion(view, camera);
    if (this.#isPhotograph) this.#hud.showMesh(mesh !== null);
    else this.#hud.showTracked(tracked, view.drawMs);
    // A network says by itself that nothing is there.
    if (!this.#isPhotograph && kind === "picture" && now - this.#trackedAt > MISSING_MS) this.#hud.showMissing();
    // A tube is bent by nature, and without a size no distance is known.
    this.#measures.show(mesh, camera, this.#isPhotograph, { bend: kind !== "tube", distance: hasSize });
    // Else the network's first answer is waited for.
    if (kind === "picture") this.#onShown();
  }

  /** @param {SurfaceMesh} mesh */
  #followDepth({ vertices }) {
    const seen = depthRange(vertices.filter((_, i) => i % 3 === 2));
    if (!seen) return;
    const last = this.#range ?? seen;
    const now = performance.now() / 1000;
    const pace = 1 - Math.exp((this.#scaledAt - now) / SCALE_SECONDS);
    this.#scaledAt = now;
    const ease = (/** @type {"near" | "far"} */ end) => last[end] + pace * (seen[end] - last[end]);
    this.#range = { near: ease("near"), far: ease("far") };
  }

  #showScale() {
    if (this.#choice.overlay === "depth" && this.#range) this.#hud.showDepthScale(this.#range);
  }

  /**
   * @param {SceneView} view
   * @param {SourcedCamera} camera
   */
  #placeRegion({ camera: { region } }, camera) {
    const { left, top, right, bottom } = visibleRegion(camera);
    const scale = this.#container.clientWidth / (region.right - region.left);
    this.#region.hidden = (right - left) * (bottom - top) > WHOLE * camera.width * camera.height;
    const place = { left: left - region.left, top: top - region.top, width: right - left, height: bottom - top };
    for (const side of /** @type {const} */ (["left", "top", "width", "height"])) this.#region.style[side] = `${place[side] * scale}px`;
  }
}
