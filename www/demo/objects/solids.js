// Small solids put together of triangles, for the things that stand on the sheet.

import { BoxGeometry, BufferGeometry, Color, Float32BufferAttribute, LatheGeometry, Vector2 } from "three";

/** @typedef {[number, number, number]} Point */
/** What is put together, (x, y, z) and colour of each corner. @typedef {{ positions: number[], colors: number[] }} Part */

/** Triangles with flat faces; y is up, and all of it stands on y = 0. */
export class Solids {
  /** @type {{ still: Part, afloat: Part }} */
  #parts = { still: { positions: [], colors: [] }, afloat: { positions: [], colors: [] } };
  #part = this.#parts.still;
  #color = new Color();

  /** What stands still, and what the waves move. */
  get geometries() {
    return Object.values(this.#parts).map(({ positions, colors }) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
      geometry.setAttribute("color", new Float32BufferAttribute(colors, 3));
      geometry.computeVertexNormals();
      return geometry;
    });
  }

  /**
   * What follows has this colour.
   *
   * @param {string} color such as "#c8553d"
   * @param {boolean} [afloat] whether the waves move it
   */
  paint(color, afloat = false) {
    this.#color.set(color);
    this.#part = this.#parts[afloat ? "afloat" : "still"];
    return this;
  }

  /** @param {Point[]} corners of triangles, three each */
  triangles(...corners) {
    this.#part.positions.push(...corners.flat());
    for (let i = 0; i < corners.length; i++) this.#part.colors.push(...this.#color);
    return this;
  }

  /** @param {BufferGeometry} geometry */
  #addGeometry(geometry) {
    const { array } = geometry.toNonIndexed().getAttribute("position");
    return this.triangles(...Array.from({ length: array.length / 3 }, (_, i) => /** @type {Point} */ ([...array.slice(3 * i, 3 * i + 3)])));
  }

  /** @param {Point} a @param {Point} b @param {Point} c @param {Point} d around the face */
  quad(a, b, c, d) {
    return this.triangles(a, b, c, a, c, d);
  }

  /** @param {Point} centre of its foot @param {Point} size */
  box([x, y, z], [width, height, depth]) {
    return this.#addGeometry(new BoxGeometry(width, height, depth).translate(x, y + height / 2, z));
  }

  /**
   * What a profile sweeps out around an upright axis.
   *
   * @param {[number, number][]} profile (radius, height) each, from below
   * @param {{ at?: [number, number], sides?: number }} [options] (x, z) of the axis
   */
  lathe(profile, { at: [x, z] = [0, 0], sides = 24 } = {}) {
    const points = profile.map((point) => new Vector2(...point));
    return this.#addGeometry(new LatheGeometry(points, sides).translate(x, 0, z));
  }

  /**
   * A plate in an upright plane: an outline with a thickness.
   *
   * @param {Point[]} outline
   * @param {Point} thickness from its one side to its other
   */
  plate(outline, thickness) {
    const other = outline.map((point) => /** @type {Point} */ (point.map((x, k) => x + thickness[k])));
    for (let i = 1; i + 1 < outline.length; i++) this.triangles(outline[0], outline[i], outline[i + 1], other[0], other[i + 1], other[i]);
    outline.forEach((point, i) => {
      const next = (i + 1) % outline.length;
      this.quad(point, outline[next], other[next], other[i]);
    });
    return this;
  }

  /**
   * A surface over the unit square.
   *
   * @param {(a: number, b: number) => Point} point
   * @param {number} columns
   * @param {number} rows
   */
  surface(point, columns, rows) {
    for (let i = 0; i < columns; i++)
      for (let j = 0; j < rows; j++) {
        const at = (/** @type {number} */ a, /** @type {number} */ b) => point((i + a) / columns, (j + b) / rows);
        this.quad(at(0, 0), at(1, 0), at(1, 1), at(0, 1));
      }
    return this;
  }
}
