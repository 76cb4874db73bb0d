// What stands on a sheet, as objects of three.js.

import { BufferGeometry, DoubleSide, Group, InterleavedBuffer, InterleavedBufferAttribute, Mesh, MeshLambertMaterial } from "three";
import { prefersStillness } from "../graphics/animation.js";
import { OBJECTS } from "./objects.js";
import { STRIDE } from "./solids.js";

/** @import { ObjectName } from "./objects.js" */

/** The radius of the circle that it stands in, of the sheet's shorter side. */
export const SCALE = 0.27;
/** Radians and seconds of the waves. */
const SWAY = 0.09;
const SWAY_SECONDS = 3.4;

export class Standing extends Group {
  #material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
  /** What the waves move. */
  #afloat = new Group();

  /** @param {ObjectName} name */
  constructor(name) {
    super();
    this.name = name;
    const corners = OBJECTS[name]();
    const triangles = Array.from({ length: corners.length / STRIDE / 3 }, (_, i) => corners.subarray(3 * STRIDE * i, 3 * STRIDE * (i + 1)));
    const sways = (/** @type {Float32Array} */ triangle) => triangle[STRIDE - 1] > 0;
    this.add(this.#mesh(triangles.filter((triangle) => !sways(triangle))), this.#afloat);
    this.#afloat.add(this.#mesh(triangles.filter(sways)));
  }

  /** @param {number} seconds by a clock */
  sway(seconds) {
    if (!prefersStillness()) this.#afloat.rotation.x = SWAY * Math.sin((2 * Math.PI * seconds) / SWAY_SECONDS);
  }

  dispose() {
    this.#material.dispose();
    this.traverse((part) => part instanceof Mesh && part.geometry.dispose());
  }

  /** @param {Float32Array[]} triangles */
  #mesh(triangles) {
    const buffer = new InterleavedBuffer(Float32Array.from(triangles.flatMap((triangle) => [...triangle])), STRIDE);
    const geometry = new BufferGeometry();
    ["position", "normal", "color"].forEach((name, i) => geometry.setAttribute(name, new InterleavedBufferAttribute(buffer, 3, 3 * i)));
    const mesh = new Mesh(geometry, this.#material);
    mesh.visible = triangles.length > 0;
    return mesh;
  }
}
