// Small solids put together of triangles, for the things that stand on the sheet.

/** @typedef {[number, number, number]} Point */

/** Numbers per corner: position, normal, colour (linear light), and how far it sways. */
export const STRIDE = 10;

/** Triangles with flat faces; y is up, and all of it stands on y = 0. */
export class Solids {
  /** @type {number[]} */
  #corners = [];
  /** @type {Point} */
  #color = [1, 1, 1];
  #sway = 0;

  /** As the shaders take them: {@link STRIDE} numbers per corner. */
  get corners() {
    return new Float32Array(this.#corners);
  }

  /**
   * What follows has this colour.
   *
   * @param {string} color such as "#c8553d"
   * @param {number} [sway] how far it moves with the waves, 0 to 1
   */
  paint(color, sway = this.#sway) {
    const linear = [1, 3, 5].map((at) => (Number.parseInt(color.slice(at, at + 2), 16) / 255) ** 2.2);
    this.#color = /** @type {Point} */ (linear);
    this.#sway = sway;
    return this;
  }

  /** @param {Point} a @param {Point} b @param {Point} c */
  triangle(a, b, c) {
    const [e, f] = [b.map((x, k) => x - a[k]), c.map((x, k) => x - a[k])];
    const normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    const length = Math.hypot(...normal);
    if (length === 0) return this;
    for (const corner of [a, b, c]) this.#corners.push(...corner, ...normal.map((x) => x / length), ...this.#color, this.#sway);
    return this;
  }

  /** @param {Point} a @param {Point} b @param {Point} c @param {Point} d around the face */
  quad(a, b, c, d) {
    return this.triangle(a, b, c).triangle(a, c, d);
  }

  /** @param {Point} centre of its foot @param {Point} size */
  box([x, y, z], [width, height, depth]) {
    const [l, r, n, f] = [x - width / 2, x + width / 2, z + depth / 2, z - depth / 2];
    const outline = /** @type {[number, number][]} */ ([[l, n], [r, n], [r, f], [l, f]]);
    return this.#walls(outline, y, y + height);
  }

  /**
   * A wall all around an outline, with a roof on it.
   *
   * @param {[number, number][]} outline (x, z) each, counter-clockwise from above
   * @param {number} bottom
   * @param {number} top
   */
  #walls(outline, bottom, top) {
    outline.forEach(([x, z], i) => {
      const [nextX, nextZ] = outline[(i + 1) % outline.length];
      this.quad([x, bottom, z], [nextX, bottom, nextZ], [nextX, top, nextZ], [x, top, z]);
      this.triangle([outline[0][0], top, outline[0][1]], [x, top, z], [nextX, top, nextZ]);
    });
    return this;
  }

  /**
   * What a profile sweeps out around an upright axis.
   *
   * @param {[number, number][]} profile (radius, height) each, from below
   * @param {{ at?: [number, number], sides?: number }} [options] (x, z) of the axis
   */
  lathe(profile, { at: [x, z] = [0, 0], sides = 24 } = {}) {
    const point = (/** @type {[number, number]} */ [radius, y], /** @type {number} */ side) => {
      const angle = (2 * Math.PI * side) / sides;
      return /** @type {Point} */ ([x + radius * Math.cos(angle), y, z - radius * Math.sin(angle)]);
    };
    for (let side = 0; side < sides; side++)
      for (let i = 0; i + 1 < profile.length; i++)
        this.quad(point(profile[i], side), point(profile[i], side + 1), point(profile[i + 1], side + 1), point(profile[i + 1], side));
    return this;
  }

  /**
   * A plate in an upright plane: an outline with a thickness.
   *
   * @param {Point[]} outline
   * @param {Point} thickness from its one side to its other
   */
  plate(outline, thickness) {
    const other = outline.map((point) => /** @type {Point} */ (point.map((x, k) => x + thickness[k])));
    for (let i = 1; i + 1 < outline.length; i++) this.triangle(outline[0], outline[i], outline[i + 1]).triangle(other[0], other[i + 1], other[i]);
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
