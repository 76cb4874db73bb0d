// A surface by itself, from the side: what the mesh knows beyond the picture.

import { AmbientLight, BackSide, DirectionalLight, FrontSide, Group, Mesh, MeshLambertMaterial, MeshPhongMaterial, PerspectiveCamera, SRGBColorSpace, Scene, Texture, Vector3, WebGLRenderer } from "three";
import { SurfaceGeometry } from "deepsft/three";
import { prefersStillness } from "./animation.js";

/** @import { MeshTopology, SurfaceMesh, Target } from "deepsft" */

/** Farthest the view turns by itself to either side, radians, and the seconds of a turn there and back. */
const SWAY = 0.62;
const SWAY_SECONDS = 9;
const PITCH = 0.22;
const MAX_PITCH = 1.35;
/** Radians a CSS pixel of dragging. */
const DRAG = 0.011;
/** Yaw and pitch, radians, of the arrow keys. @type {Readonly<Record<string, [number, number]>>} */
const KEYS = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] };
/** Seconds in which the view follows the surface most of the way: it stands, the surface moves. */
const FOLLOW_SECONDS = 0.6;
/** From the eye to the middle, in sizes: a mild perspective. */
const DISTANCE = 3.2;

/**
 * A view on a canvas, which is hidden where there can be none.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {Orbit | null} null where the browser offers no WebGL 2
 */
export function orbitOn(canvas) {
  try {
    return new Orbit(canvas);
  } catch {
    canvas.hidden = true;
    return null;
  }
}

export class Orbit {
  #canvas;
  #renderer;
  #scene = new Scene();
  #camera = new PerspectiveCamera((2 * 180 * Math.atan(1 / DISTANCE)) / Math.PI, 1, 1, 1e5);
  #turned = new Group();
  /** @type {{ geometry: SurfaceGeometry, print: Texture, faces: Uint32Array, surfaces: Mesh[] } | null} */
  #surface = null;
  #size = 1;
  /** @type {Vector3 | null} */
  #centre = null;
  #shownAt = 0;
  #yaw = 0;
  #pitch = PITCH;
  /** Whether someone has turned the view: then it stays as they left it. */
  #held = false;

  /**
   * @param {HTMLCanvasElement} canvas
   * @throws where the browser offers no WebGL 2
   */
  constructor(canvas) {
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, alpha: true, antialias: true });
    const key = new DirectionalLight(0xffffff, 3);
    key.position.set(-0.55, 0.7, 0.6);
    this.#scene.add(key, new AmbientLight(0xffffff, 0.9), this.#turned);
    this.#listen();
  }

  /** @param {Pick<Target, "texture" | "widthMm" | "heightMm"> & { mesh: MeshTopology }} template */
  setTemplate({ texture, widthMm, heightMm, mesh }) {
    for (const { material } of this.#surface?.surfaces ?? []) /** @type {import("three").Material} */ (material).dispose();
    this.#surface?.geometry.dispose();
    this.#surface?.print.dispose();
    const geometry = new SurfaceGeometry(mesh);
    const print = new Texture(texture);
    Object.assign(print, { colorSpace: SRGBColorSpace, anisotropy: 4, needsUpdate: true });
    const front = new MeshPhongMaterial({ map: print, specular: 0x222222, side: FrontSide });
    const surfaces = [front, new MeshLambertMaterial({ color: 0xd8d4cc, side: BackSide })].map((material) => new Mesh(geometry, material));
    this.#turned.clear().add(...surfaces);
    this.#surface = { geometry, print, faces: mesh.faces, surfaces };
    this.#size = 0.54 * Math.hypot(widthMm, heightMm);
  }

  /** Forgets where the surface was, and how the view was turned. */
  reset() {
    this.#centre = null;
    [this.#yaw, this.#pitch, this.#held] = [0, PITCH, false];
  }

  /**
   * Draws a mesh, if the view is on the page.
   *
   * @param {Pick<SurfaceMesh, "vertices">} mesh
   */
  show({ vertices }) {
    if (this.#canvas.clientWidth === 0 || !this.#surface) return;
    const { geometry, faces, surfaces } = this.#surface;
    geometry.update({ vertices, faces });
    const middle = geometry.boundingSphere?.center ?? new Vector3();
    const now = performance.now() / 1000;
    const pace = 1 - Math.exp((this.#shownAt - now) / FOLLOW_SECONDS);
    this.#shownAt = now;
    this.#centre = this.#centre?.lerp(middle, pace) ?? middle.clone();
    for (const surface of surfaces) surface.position.copy(this.#centre).negate();
    this.#draw();
  }

  #draw() {
    if (!this.#centre) return;
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const density = Math.min(2, devicePixelRatio);
    if (this.#canvas.width !== Math.floor(width * density) || this.#canvas.height !== Math.floor(height * density)) {
      this.#renderer.setPixelRatio(density);
      this.#renderer.setSize(width, height, false);
    }
    const phase = prefersStillness() ? 0.25 : performance.now() / 1000 / SWAY_SECONDS;
    const yaw = this.#held ? this.#yaw : SWAY * Math.sin(2 * Math.PI * phase);
    // First about the upright axis, then about that to the right.
    this.#turned.rotation.set(this.#pitch, -yaw, 0, "XYZ");
    // All of it is seen in a narrow view too.
    this.#camera.position.z = DISTANCE * this.#size * Math.max(1, height / width);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#renderer.render(this.#scene, this.#camera);
  }

  /**
   * @param {number} yaw radians
   * @param {number} pitch radians
   */
  #turn(yaw, pitch) {
    if (!this.#held) this.#yaw = 0;
    this.#held = true;
    this.#yaw += yaw;
    this.#pitch = Math.min(MAX_PITCH, Math.max(-MAX_PITCH, this.#pitch + pitch));
    this.#draw();
  }

  #listen() {
    const canvas = this.#canvas;
    // Positions rather than `movementX`, whose unit differs between browsers and screens.
    let [x, y] = [0, 0];
    canvas.addEventListener("pointerdown", ({ pointerId, clientX, clientY }) => {
      canvas.setPointerCapture(pointerId);
      [x, y] = [clientX, clientY];
      this.#turn(0, 0);
    });
    canvas.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
      if (!canvas.hasPointerCapture(pointerId)) return;
      const [right, down] = [clientX - x, clientY - y];
      [x, y] = [clientX, clientY];
      this.#turn(DRAG * right, -DRAG * down);
    });
    canvas.addEventListener("keydown", (event) => {
      const turn = KEYS[event.key];
      if (!turn) return;
      event.preventDefault();
      this.#turn(...turn);
    });
  }
}
