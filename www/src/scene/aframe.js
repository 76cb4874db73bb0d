// `deepsft/aframe`: a scene of A-Frame before a camera, as components. A-Frame's script comes first.

import { Scene } from "three";
import { DeepSftError, asDeepSftError } from "../error.js";
import { start } from "./index.js";

/** @import { Object3D, WebGLRenderer } from "three" */
/** @import { SceneView } from "./scene-view.js" */

/**
 * What is used of an entity of A-Frame, and of its scene, which is one too.
 *
 * @typedef {HTMLElement & { object3D: Object3D, sceneEl: SceneElement, emit: (name: string, detail: unknown, bubbles: boolean) => void,
 *   setObject3D: (name: string, object: Object3D) => void, components: Record<string, any> }} Entity
 * @typedef {Entity & { object3D: Scene, renderer: WebGLRenderer, camera: Object3D & { el: Entity }, systems: Record<string, any>,
 *   renderStarted: boolean, render: (time: number, frame?: XRFrame) => void }} SceneElement
 */

const { AFRAME } = /** @type {{ AFRAME?: { registerComponent: (name: string, definition: object) => void } }} */ (globalThis);
if (!AFRAME) throw new DeepSftError("invalid-argument", "A-Frame is not there: its script, or its import, comes before that of deepsft/aframe.");

/** The events of a scene that the element of A-Frame's scene fires too. */
const EVENTS = /** @type {const} */ (["found", "lost", "frame", "error"]);
const text = { type: "string" };

/**
 * `<a-scene deepsft="picture: poster.jpg; width-mm: 420; print: film.mp4">`: the camera's picture behind the scene, and what is printed in the
 * place of the print. The scene's element fires `started` with `{ view }`, and `found`, `lost`, `frame` and `error`.
 */
AFRAME.registerComponent("deepsft", {
  sceneOnly: true,
  schema: { picture: text, widthMm: { type: "number" }, print: text, facing: text, baseUrl: text, source: { type: "selector" } },
  /** The scene that runs; null while there is none. @type {SceneView | null} */
  view: null,

  /** @this {any} */
  init() {
    const scene = /** @type {SceneElement} */ (this.el);
    // The paper has a light of its own, and the camera is the person's.
    scene.setAttribute("light", "defaultLightsEnabled: false");
    scene.systems.light.removeDefaultLights();
    for (const name of ["xr-mode-ui", "device-orientation-permission-ui"]) scene.setAttribute(name, "enabled: false");
    const eye = scene.camera.el;
    for (const name of ["look-controls", "wasd-controls"]) eye.removeAttribute(name);
    for (const name of ["position", "rotation"]) eye.setAttribute(name, "0 0 0");
  },

  /** @this {any} */
  async update() {
    this.remove();
    const { signal } = (this.leaving = new AbortController());
    const scene = /** @type {SceneElement} */ (this.el);
    const { picture, widthMm, print, facing, baseUrl, source } = this.data;
    const tell = (/** @type {string} */ name, /** @type {unknown} */ detail) => scene.emit(name, detail, false);
    try {
      if (!(scene.object3D instanceof Scene)) throw new DeepSftError("invalid-argument", "A-Frame has a three.js of its own beside that of deepsft/aframe: docs/scene.md says how they share one.");
      const options = { widthMm: widthMm || undefined, facing: facing || undefined, load: { baseUrl: baseUrl || undefined }, source: source ?? undefined };
      const view = await start(scene, { picture, ...options, signal, host: { renderer: scene.renderer, scene: scene.object3D } });
      this.view = view;
      scene.camera.el.setObject3D("camera", view.camera);
      Object.assign(scene, { camera: view.camera });
      for (const name of EVENTS) view.addEventListener(name, (/** @type {CustomEvent} */ { detail }) => tell(name, detail));
      // Where the processor draws, A-Frame draws what is new alone.
      const pace = () => scene.renderer.setAnimationLoop((time, frame) => (this.view?.due ?? true) && scene.render(time, frame));
      if (scene.renderStarted) pace();
      else scene.addEventListener("renderstart", pace, { once: true, signal });
      tell("started", { view });
      if (print) await view.sheet().print(print);
    } catch (error) {
      if (!signal.aborted) tell("error", { error: asDeepSftError(error) });
    }
  },

  /** @this {any} */
  tick() {
    this.view?.prepare();
  },

  /** @this {any} */
  tock() {
    this.view?.drawn();
  },

  /** @this {any} */
  remove() {
    this.leaving?.abort();
    this.view = null;
  },
});

/** `<a-entity deepsft-anchor="u: 0.5; v: 0.5">` stands on a place of the print, with y up from the paper, in metres. */
AFRAME.registerComponent("deepsft-anchor", {
  schema: { u: { type: "number", default: 0.5 }, v: { type: "number", default: 0.5 }, unit: { default: "m", oneOf: ["m", "mm", "width"] } },

  /** @this {any} */
  init() {
    this.stand = () => this.update();
    // What is loaded later casts its shadow too.
    this.take = () => this.anchor?.add(this.el.object3D);
    this.el.sceneEl.addEventListener("started", this.stand);
    this.el.addEventListener("object3dset", this.take);
  },

  /** @this {any} */
  update() {
    const { view } = this.el.sceneEl.components.deepsft ?? {};
    this.anchor?.removeFromParent();
    const { u, v, unit } = this.data;
    this.anchor = view?.sheet().anchor(u, v, { unit }) ?? null;
    // Nothing is seen of it before it has a place.
    this.el.object3D.removeFromParent();
    this.take();
  },

  /** @this {any} */
  remove() {
    this.el.sceneEl.removeEventListener("started", this.stand);
    this.el.removeEventListener("object3dset", this.take);
    this.anchor?.removeFromParent();
  },
});
