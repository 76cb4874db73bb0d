// What the person chose to see on the sheet of a scene.

import { Raycaster, Vector2 } from "three";
import { prefersStillness } from "../graphics/animation.js";
import { PaperPainter } from "../graphics/paper-painter.js";
import { SCALE, Standing } from "../objects/standing.js";
import { MeshLines, depthMaterial, plasterMaterial, veilMaterial } from "./overlay-materials.js";

/** @import { SurfaceMesh, Target } from "deepsft" */
/** @import { SceneView } from "deepsft/scene" */
/** @import { Anchor } from "deepsft/three" */
/** @import { Paper } from "../graphics/papers.js" */
/** @import { ObjectName } from "../objects/objects.js" */

/** @typedef {"paper" | "object" | "shaded" | "mesh" | "depth" | "plain"} Overlay */
/** @typedef {{ overlay: Overlay, paper: Paper, object: ObjectName }} Choice */
/** Near and far end of the colours, and step of the contours, in the target's unit. @typedef {{ near: number, far: number, step: number }} DepthScale */

/** The moment at which papers look well that do not move. */
const STILL_SECONDS = 5.2;
/** A place nearer to the border would have an object stand half in the air, of the sheet's sides. */
const BORDER = 0.1;
/** What the arrow keys move the object by, of the print's sides. @type {Readonly<Record<string, [number, number]>>} */
const STEPS = { ArrowLeft: [-0.04, 0], ArrowRight: [0.04, 0], ArrowUp: [0, -0.04], ArrowDown: [0, 0.04] };

export class Overlays {
  #view;
  #sheet;
  /** @type {Choice | null} */
  #choice = null;
  /** @type {PaperPainter | null} */
  #painter = null;
  /** @type {ReturnType<typeof depthMaterial> | null} */
  #depth = null;
  /** @type {MeshLines | null} */
  #lines = null;
  /** @type {{ anchor: Anchor, standing: Standing } | null} */
  #object = null;
  /** What was followed last. @type {{ mesh: SurfaceMesh | null, depthScale: DepthScale }} */
  #newest = { mesh: null, depthScale: { near: 0, far: 1, step: 1 } };
  /** Where an object stands, (u, v). @type {[number, number]} */
  #place = [0.5, 0.5];

  /**
   * @param {SceneView} view
   * @param {Target} target
   * @param {HTMLElement} stage where a tap on the sheet and the arrow keys move the object
   * @param {AbortSignal} signal ends that
   */
  constructor(view, target, stage, signal) {
    this.#view = view;
    this.#sheet = view.sheet(target);
    const tapped = (/** @type {MouseEvent} */ { clientX, clientY }) => {
      if (!this.#object || !this.#sheet.visible) return;
      const { left, top, width, height } = stage.getBoundingClientRect();
      const ray = new Raycaster();
      ray.setFromCamera(new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height), view.camera);
      const [hit] = ray.intersectObject(this.#sheet.occluder);
      if (hit?.uv) this.#stand(hit.uv.x, 1 - hit.uv.y);
    };
    stage.addEventListener("click", tapped, { signal });
    const pressed = (/** @type {KeyboardEvent} */ event) => {
      const step = STEPS[event.key];
      if (!step || !this.#object) return;
      event.preventDefault();
      this.#stand(this.#place[0] + step[0], this.#place[1] + step[1]);
    };
    stage.addEventListener("keydown", pressed, { signal });
  }

  /** @param {Choice} choice */
  show(choice) {
    const { overlay, paper, object } = (this.#choice = choice);
    const sheet = this.#sheet;
    this.#clear();
    if (overlay === "paper") {
      this.#painter ??= new PaperPainter(this.#view.renderer, sheet.target, this.#view.software);
      this.#painter.paint(paper, STILL_SECONDS);
      sheet.map = this.#painter.texture;
    }
    if (overlay === "shaded") sheet.material = plasterMaterial(sheet.target);
    if (overlay === "depth") sheet.material = this.#depth = depthMaterial();
    if (overlay === "mesh") {
      sheet.material = veilMaterial();
      sheet.add((this.#lines = new MeshLines(sheet)));
    }
    if (overlay === "object") {
      const standing = new Standing(object);
      const { widthMm, heightMm } = sheet.target;
      standing.scale.setScalar(SCALE * Math.min(1, heightMm / widthMm));
      this.#object = { anchor: sheet.anchor(...this.#place, { unit: "width" }), standing };
      this.#object.anchor.add(standing);
    }
    this.follow(this.#newest.mesh, this.#newest.depthScale);
    this.#view.refresh();
  }

  /**
   * Takes over a frame, before it is drawn.
   *
   * @param {SurfaceMesh | null} mesh
   * @param {DepthScale} depthScale
   */
  follow(mesh, depthScale) {
    const { near, far, step } = depthScale;
    this.#newest = { mesh, depthScale };
    this.#depth?.uniforms.u_scale.value.set(near, far, step);
    if (mesh) this.#lines?.follow(mesh);
  }

  /** Moves what moves by itself, before it is drawn. */
  animate() {
    const seconds = performance.now() / 1000;
    this.#object?.standing.sway(seconds);
    if (this.#choice?.overlay === "paper" && !this.#view.software && !prefersStillness()) this.#painter?.paint(this.#choice.paper, seconds);
  }

  dispose() {
    this.#clear();
    this.#painter?.dispose();
  }

  /** @param {number} u @param {number} v */
  #stand(u, v) {
    const within = (/** @type {number} */ at) => Math.min(1 - BORDER, Math.max(BORDER, at));
    this.#place = [within(u), within(v)];
    this.#object?.anchor.place(...this.#place);
    this.#object?.anchor.follow(this.#sheet.geometry, performance.now());
    this.#view.refresh();
  }

  #clear() {
    this.#sheet.material = null;
    this.#lines?.removeFromParent();
    this.#lines?.dispose();
    this.#object?.anchor.removeFromParent();
    this.#object?.standing.dispose();
    [this.#depth, this.#lines, this.#object] = [null, null, null];
  }
}
