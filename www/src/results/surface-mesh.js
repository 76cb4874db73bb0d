// The whole surface of the object in one frame, hidden parts included.

import { verticesInImage } from "../camera/canonical.js";
import { placeOn } from "./place.js";

/** @import { Camera, MeshTopology } from "../index.js" */
/** @import { RawSurface } from "../../pkg/deepsft_web.js" */

/**
 * Where a mesh comes from: fitted to one image (`fit`), completed from the finder's maps (`completion`), or followed through a
 * video (`tracking`).
 *
 * @typedef {"fit" | "completion" | "tracking"} MeshMethod
 */

/** A triangle mesh in the camera's frame. */
export class SurfaceMesh {
  /** @type {Float32Array | null} */
  #normals = null;

  /**
   * @param {Omit<RawSurface, "deviations"> & Partial<RawSurface>} raw
   * @param {MeshTopology} topology
   * @param {MeshMethod} method
   */
  constructor({ vertices, confidence, deviations = new Float32Array() }, { faces, textureCoordinates, perMm = 1 }, method) {
    const inUnits = (/** @type {Float32Array} */ lengths) => (perMm === 1 ? lengths : lengths.map((mm) => perMm * mm));
    /** (x, y, z) of each vertex, mm (or in the target's `unit`), camera frame: x right, y down, z forward. */
    this.vertices = inUnits(vertices);
    /**
     * How far the image confirms each vertex, 0 to 1: low where nothing is printed, 0 where it is not seen. Of `completion`: 1 where the
     * finder sees the vertex, else 0.
     */
    this.confidence = confidence;
    /**
     * Standard deviation of the place of each vertex, mm, along the direction in which it is least sure: what is hidden or blank is
     * loose. Known of a mesh that was fitted to one image; else empty.
     */
    this.deviations = inUnits(deviations);
    /** Three vertex indices per face, counter-clockwise seen from the printed side. The same array for every frame. */
    this.faces = faces;
    /** (u, v) of each vertex in the template's picture, v down. The same array for every frame. */
    this.textureCoordinates = textureCoordinates;
    /** Where it comes from. */
    this.method = method;
  }

  /**
   * Unit normals (x, y, z) of the vertices, camera frame: the mean of the faces around each, by their area. They point away
   * from the printed side's back: towards the camera where the print is seen.
   *
   * @returns {Float32Array} computed once
   */
  get normals() {
    this.#normals ??= vertexNormals(this.vertices, this.faces, new Float32Array(this.vertices.length));
    return this.#normals;
  }

  /**
   * Where a place of the template's picture is.
   *
   * @param {number} u 0 at the left border, 1 at the right
   * @param {number} v 0 at the top, 1 at the bottom
   * @returns {[number, number, number]} (x, y, z), mm, camera frame
   * @throws {DeepSftError} `invalid-argument` where the target has no surface
   */
  pointAt(u, v) {
    const { face, weights } = placeOn(this, u, v);
    const along = (/** @type {number} */ axis) =>
      weights.reduce((sum, weight, k) => sum + weight * this.vertices[3 * this.faces[face + k] + axis], 0);
    return [along(0), along(1), along(2)];
  }

  /**
   * Which place of the template's picture is seen at a pixel, the nearest where the surface lies before itself: where someone taps.
   *
   * @param {number} x pixels of the camera's image
   * @param {number} y
   * @param {Camera} camera `tracked.camera`
   * @returns {[number, number] | null} (u, v); null beside the surface, and where its back is seen
   */
  placeAt(x, y, camera) {
    const points = verticesInImage(this.vertices, camera);
    const { faces, vertices, textureCoordinates: uv } = this;
    let [nearest, isFront] = [Infinity, false];
    /** @type {[number, number]} */
    const place = [0, 0];
    for (let i = 0; i < faces.length; i += 3) {
      const [a, b, c] = [faces[i], faces[i + 1], faces[i + 2]];
      const [bx, by, cx, cy] = [points[2 * b] - points[2 * a], points[2 * b + 1] - points[2 * a + 1], points[2 * c] - points[2 * a], points[2 * c + 1] - points[2 * a + 1]];
      const area = bx * cy - by * cx;
      const [px, py] = [x - points[2 * a], y - points[2 * a + 1]];
      const [atB, atC] = [(px * cy - py * cx) / area, (bx * py - by * px) / area];
      if (!(Math.min(atB, atC, 1 - atB - atC) >= 0)) continue;
      // What is far takes less of the image.
      const [wa, wb, wc] = [(1 - atB - atC) / vertices[3 * a + 2], atB / vertices[3 * b + 2], atC / vertices[3 * c + 2]];
      const depth = 1 / (wa + wb + wc);
      if (depth >= nearest) continue;
      // Counter-clockwise from the front, in an image whose y points down.
      [nearest, isFront] = [depth, area < 0];
      for (const k of /** @type {const} */ ([0, 1])) place[k] = depth * (wa * uv[2 * a + k] + wb * uv[2 * b + k] + wc * uv[2 * c + k]);
    }
    return isFront ? place : null;
  }
}

/**
 * @param {Float32Array} vertices
 * @param {Uint32Array} faces
 * @param {Float32Array} normals zeros, filled
 * @returns {Float32Array} `normals`
 */
export function vertexNormals(vertices, faces, normals) {
  // Plain numbers throughout: lists that live for one face cost ten times the arithmetic.
  for (let i = 0; i < faces.length; i += 3) {
    const a = 3 * faces[i];
    const b = 3 * faces[i + 1];
    const c = 3 * faces[i + 2];
    const ux = vertices[b] - vertices[a];
    const uy = vertices[b + 1] - vertices[a + 1];
    const uz = vertices[b + 2] - vertices[a + 2];
    const vx = vertices[c] - vertices[a];
    const vy = vertices[c + 1] - vertices[a + 1];
    const vz = vertices[c + 2] - vertices[a + 2];
    // The cross product's length is twice the face's area.
    const x = uy * vz - uz * vy;
    const y = uz * vx - ux * vz;
    const z = ux * vy - uy * vx;
    for (let k = 0; k < 3; k++) {
      const at = 3 * faces[i + k];
      normals[at] += x;
      normals[at + 1] += y;
      normals[at + 2] += z;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.sqrt(normals[i] ** 2 + normals[i + 1] ** 2 + normals[i + 2] ** 2) || 1;
    for (let k = 0; k < 3; k++) normals[i + k] /= length;
  }
  return normals;
}
