// A tracked target in a scene: what hides things, what is printed anew, and what stands on it.

import { BufferAttribute, DoubleSide, DynamicDrawUsage, Group, Mesh, MeshBasicMaterial } from "three";
import { PrintCovering } from "../light/print-covering.js";
import { smallPixels } from "../light/small-frame.js";
import { TemplateLight } from "../light/template-light.js";
import { VertexLight } from "../light/vertex-light.js";
import { Anchor } from "./anchor.js";
import { SurfaceGeometry } from "./surface-geometry.js";

/** @import { Material, Texture } from "three" */
/** @import { SourcedCamera } from "../camera/intrinsics.js" */
/** @import { SurfaceMesh } from "../results/surface-mesh.js" */
/** @import { TrackedFrame } from "../results/tracked-frame.js" */
/** @import { Target } from "../targets/target.js" */

/** From this correlation on the mesh lies well enough for its confidence to tell what covers it. */
const MIN_CORRELATION = 0.6;
/** Fraction of a vertex's surroundings that is seen, from which on the new print begins to show, and shows fully. */
const SEEN = { from: 0.3, fully: 0.7 };

/**
 * @typedef {object} SheetOptions
 * @property {Texture} [map] a new print, upright like any texture of three.js: a picture, a canvas, a video. It is lit as the real
 *   paper is, and where something lies before the paper it is left out.
 * @property {Material} [material] a material of one's own in place of that; with `vertexColors` the light of the paper is multiplied into
 *   its colours
 */

/** The surface of a target. It has its place in the camera's frame: add it to the scene, or to the camera if that is moved. */
export class Sheet extends Group {
  /** @type {{ template: VertexLight, covering: PrintCovering, colors: BufferAttribute } | null} */
  #light = null;

  /**
   * @param {Target} target
   * @param {SheetOptions} [options] without a print the sheet is seen as it is, and only hides what is behind it
   */
  constructor(target, { map, material = map && paperMaterial(map) } = {}) {
    super();
    /** What it shows. */
    this.target = target;
    this.name = target.name;
    this.visible = false;
    /** What all of it is drawn from, updated in place. */
    this.geometry = new SurfaceGeometry(target.mesh);
    /** Draws nothing, and hides what is behind the sheet: both sides do. */
    this.occluder = new Mesh(this.geometry, occluderMaterial());
    this.occluder.renderOrder = -2;
    this.add(this.occluder);
    /** What is printed on it; null for none. The blank back stays as the camera sees it. */
    this.paper = material ? new Mesh(this.geometry, material) : null;
    if (!this.paper || !material) return;
    this.paper.renderOrder = -1;
    this.paper.receiveShadow = true;
    this.add(this.paper);
    if (!material.vertexColors) return;
    const { count } = this.geometry.getAttribute("position");
    const colors = new BufferAttribute(new Float32Array(4 * count).fill(1), 4).setUsage(DynamicDrawUsage);
    this.geometry.setAttribute("color", colors);
    const template = new VertexLight(target.mesh, new TemplateLight(target.texture));
    this.#light = { template, covering: new PrintCovering(target), colors };
  }

  /**
   * An object whose pose follows a place on the sheet.
   *
   * @param {number} u from the print's left border to its right, 0 to 1
   * @param {number} v from its top to its bottom
   * @param {{ smooth?: boolean }} [options] as in {@link Anchor}
   * @returns {Anchor} a child of the sheet: `sheet.remove(anchor)` lets it go
   * @throws {RangeError} where the target has no surface
   */
  anchor(u, v, options) {
    const anchor = new Anchor(this.target.mesh, u, v, options);
    this.add(anchor);
    return anchor;
  }

  /**
   * Follows a frame of the video. While the target is lost, nothing of the sheet is visible.
   *
   * @param {TrackedFrame} tracked its frame must be open where a new print is lit
   * @param {number} [atMs] when, milliseconds
   */
  update(tracked, atMs = performance.now()) {
    const seen = tracked.of(this.target);
    if (!seen?.mesh) {
      this.visible = false;
      // What covered it may be gone when it is found again.
      this.#light?.covering.reset();
      for (const anchor of this.#anchors()) anchor.lose();
      return;
    }
    this.show(seen.mesh, atMs);
    if (tracked.frame) this.#shade(seen.mesh, tracked.camera, tracked.frame, seen.correlation >= MIN_CORRELATION);
  }

  /**
   * Takes the shape of a mesh, as a single image gives it.
   *
   * @param {SurfaceMesh} mesh of the same target
   * @param {number} [atMs]
   * @throws {RangeError} for the mesh of another target
   */
  show(mesh, atMs = performance.now()) {
    this.geometry.update(mesh);
    for (const anchor of this.#anchors()) anchor.follow(this.geometry, atMs);
    this.visible = true;
  }

  /** Lets geometry and materials go; a print's texture stays the page's. */
  dispose() {
    this.geometry.dispose();
    for (const mesh of [this.occluder, this.paper]) /** @type {Material | undefined} */ (mesh?.material)?.dispose();
  }

  #anchors() {
    return this.children.filter((child) => child instanceof Anchor);
  }

  /**
   * The light on the paper, and what of it is seen, as colours of the vertices.
   *
   * @param {SurfaceMesh} mesh
   * @param {SourcedCamera} camera
   * @param {ImageBitmap} frame
   * @param {boolean} certain
   */
  #shade(mesh, camera, frame, certain) {
    if (!this.#light) return;
    const { template, covering, colors } = this.#light;
    const seen = covering.follow(mesh, certain);
    const light = template.of(mesh.vertices, seen, camera, smallPixels(frame));
    for (let i = 0; i < light.length; i++) {
      const shown = Math.min(1, Math.max(0, (seen[i] - SEEN.from) / (SEEN.fully - SEEN.from)));
      colors.setXYZW(i, light[i], light[i], light[i], shown * shown * (3 - 2 * shown));
    }
    colors.needsUpdate = true;
  }
}

/** Writes depth alone, a little behind the surface, so that what lies on it is not hidden. */
function occluderMaterial() {
  return new MeshBasicMaterial({ colorWrite: false, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 });
}

/** @param {Texture} map */
function paperMaterial(map) {
  return new MeshBasicMaterial({ map, vertexColors: true, transparent: true, depthWrite: false, toneMapped: false });
}
