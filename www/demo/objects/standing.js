// What stands on a sheet, as objects of three.js.

import { DoubleSide, Group, Mesh, MeshLambertMaterial } from "three";
import { prefersStillness } from "../graphics/animation.js";
import { OBJECTS } from "./objects.js";

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
    const [still, afloat] = OBJECTS[name]().geometries.map((geometry) => new Mesh(geometry, this.#material));
    this.add(still, this.#afloat);
    this.#afloat.add(afloat);
  }

  /** @param {number} seconds by a clock */
  sway(seconds) {
    if (!prefersStillness()) this.#afloat.rotation.x = SWAY * Math.sin((2 * Math.PI * seconds) / SWAY_SECONDS);
  }

  dispose() {
    this.#material.dispose();
    this.traverse((part) => part instanceof Mesh && part.geometry.dispose());
  }
}
