// A tracked mesh as geometry of three.js.

import { BufferAttribute, BufferGeometry, DynamicDrawUsage } from "three";
import { DeepSftError } from "../error.js";
import { vertexNormals } from "../results/surface-mesh.js";

/** @import { MeshTopology } from "../engine/engine-worker.js" */

/**
 * The mesh of a target in the frame of three.js, mm. Faces are counter-clockwise seen from the printed side. `uv` has v up, as textures
 * of three.js do.
 */
export class SurfaceGeometry extends BufferGeometry {
  #positions;
  #normals;

  /** @param {MeshTopology} topology `target.mesh` */
  constructor({ faces, textureCoordinates }) {
    super();
    const count = textureCoordinates.length / 2;
    const attribute = () => new BufferAttribute(new Float32Array(3 * count), 3).setUsage(DynamicDrawUsage);
    this.#positions = attribute();
    this.#normals = attribute();
    this.setIndex(new BufferAttribute(faces, 1));
    this.setAttribute("position", this.#positions);
    this.setAttribute("normal", this.#normals);
    const uv = textureCoordinates.map((c, i) => (i % 2 === 0 ? c : 1 - c));
    this.setAttribute("uv", new BufferAttribute(uv, 2));
  }

  /**
   * Takes the shape of a mesh; nothing is allocated.
   *
   * @param {{ vertices: Float32Array, faces: Uint32Array }} mesh a `SurfaceMesh` of the same target
   * @throws {DeepSftError} `invalid-argument` for the mesh of another target
   */
  update({ vertices, faces }) {
    const [positions, normals] = [this.#positions, this.#normals];
    if (vertices.length !== positions.array.length)
      throw new DeepSftError("invalid-argument", `The mesh has ${vertices.length / 3} vertices, that of the target ${positions.count}.`);
    const filled = /** @type {Float32Array} */ (normals.array);
    turnedFrame(vertices, /** @type {Float32Array} */ (positions.array));
    turnedFrame(vertexNormals(vertices, faces, filled.fill(0)));
    positions.needsUpdate = true;
    normals.needsUpdate = true;
    this.computeBoundingSphere();
  }
}

/**
 * The one conversion between our frame and that of three.js: points or directions of the camera's frame (x right, y down, z forward) in
 * that of a camera of three.js (x right, y up, z backward), or back: half a turn about x is its own inverse. Lengths stay, so a unit is a
 * millimetre in both.
 *
 * @param {Float32Array} from (x, y, z) each
 * @param {Float32Array} [to] filled; `from` itself when absent
 * @returns {Float32Array} `to`
 */
export function turnedFrame(from, to = from) {
  for (let i = 0; i < from.length; i += 3) {
    to[i] = from[i];
    to[i + 1] = -from[i + 1];
    to[i + 2] = -from[i + 2];
  }
  return to;
}
