// The light on a sheet as lights of a scene, for what stands on it.

import { Box3, Color, DirectionalLight, Group, HemisphereLight, Sphere, Vector3 } from "three";
import { SheetLight } from "../light/sheet-light.js";

/** @import { Object3D } from "three" */

/** A surface that lies on the sheet face down receives so much of the light from everywhere. */
const FROM_BELOW = 0.44;
/** Pixels of the shadow's map along a side. */
const SHADOW_PIXELS = 1024;
/** The shadow falls on what is so many times farther away than what casts it reaches. */
const SHADOW_REACH = 4;

/**
 * Light from somewhere, with shadows, and from everywhere, as bright as the sheet shows it: white stands out from white paper by its
 * shape alone. The child of a sheet.
 */
export class PaperLight extends Group {
  #light = new SheetLight();
  #direction = new Vector3(0, 0, 1);

  constructor() {
    super();
    this.name = "light";
    /** From somewhere. */
    this.directed = new DirectionalLight();
    this.directed.castShadow = true;
    this.directed.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    /** From everywhere. */
    this.everywhere = new HemisphereLight(0xffffff, new Color().setScalar(FROM_BELOW));
    this.add(this.directed, this.directed.target, this.everywhere);
    /** Fraction of the light on the sheet that is left in a shadow. */
    this.shade = 1;
  }

  /** Forgets the light: the sheet was lost. */
  reset() {
    this.#light.reset();
  }

  /**
   * Takes over how bright the sheet is; the sheet calls it.
   *
   * @param {Float32Array} light on each vertex, as `VertexLight` tells it
   * @param {Float32Array} normals of the vertices, in the camera's frame of `deepsft`
   * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
   * @param {number} atMs
   */
  follow(light, normals, seen, atMs) {
    this.#light.follow(light, normals, seen, atMs);
    const { everywhere, directed } = this.#light.light;
    const sums = [0, 0, 0];
    for (let i = 0; i < normals.length; i++) sums[i % 3] += normals[i];
    // Half a turn about x, as everything here.
    const up = new Vector3(sums[0], -sums[1], -sums[2]).normalize();
    this.#direction.set(directed[0], -directed[1], -directed[2]);
    const strength = this.#direction.length();
    this.#direction.divideScalar(strength || 1);
    // Lights of three.js are counted so that a white surface reflects a π-th of them.
    this.directed.intensity = Math.PI * strength;
    this.everywhere.intensity = Math.PI * everywhere;
    this.everywhere.position.copy(up);
    this.shade = everywhere / Math.max(1e-3, everywhere + strength * Math.max(0, up.dot(this.#direction)));
  }

  /**
   * Lets the light fall on what stands on the sheet, so that its shadow is as sharp as it can be; the sheet calls it.
   *
   * @param {Object3D[]} objects
   */
  shineOn(objects) {
    const box = new Box3();
    for (const object of objects) box.expandByObject(object);
    this.directed.castShadow = !box.isEmpty();
    if (box.isEmpty()) return void this.directed.position.copy(this.#direction);
    const { center, radius } = box.getBoundingSphere(new Sphere());
    const { camera } = this.directed.shadow;
    Object.assign(camera, { left: -radius, right: radius, top: radius, bottom: -radius, near: 0, far: (2 + SHADOW_REACH) * radius });
    camera.updateProjectionMatrix();
    this.directed.shadow.normalBias = (3 * radius) / SHADOW_PIXELS;
    const { target, position } = this.directed;
    this.worldToLocal(target.position.copy(center));
    position.copy(this.#direction).multiplyScalar((2 * radius) / this.getWorldScale(new Vector3()).x).add(target.position);
  }
}
