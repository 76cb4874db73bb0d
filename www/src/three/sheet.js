// A tracked target in a scene: what hides things, what is printed anew, what stands on it, and the light on all of it.

import { BufferAttribute, DoubleSide, DynamicDrawUsage, Group, Mesh, MeshBasicMaterial, ShaderMaterial, ShadowMaterial } from "three";
import { MaskCovering } from "../light/mask-covering.js";
import { PrintCovering } from "../light/print-covering.js";
import { gentleRamp } from "../light/ramp.js";
import { smallPixels } from "../light/small-frame.js";
import { TemplateLight } from "../light/template-light.js";
import { VertexLight } from "../light/vertex-light.js";
import { Anchor } from "./anchor.js";
import { PaperLight } from "./paper-light.js";
import { SurfaceGeometry } from "./surface-geometry.js";

/** @import { Material, Texture } from "three" */
/** @import { Estimate, SurfaceMesh, Target, TrackedFrame } from "../index.js" */
/** @import { AnchorOptions } from "./anchor.js" */

/** From this correlation on the mesh lies well enough for its confidence to tell what covers it. */
const MIN_CORRELATION = 0.6;
/** Fraction of a vertex's surroundings that is seen, from which on the new print begins to show, and shows fully. */
const SEEN = { from: 0.3, fully: 0.7 };
/** A little behind the surface, so that what lies on it is not hidden. */
const BEHIND = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 };
/** Who is drawn after whom. */
const ORDER = { cover: -4, occluder: -3, paper: -2, shadow: -1 };

/**
 * @typedef {object} SheetOptions
 * @property {Texture} [map] a new print, upright like any texture of three.js: a picture, a canvas, a video. It is lit as the real
 *   paper is, and where something lies before the paper it is left out.
 * @property {Material} [material] a material of one's own in place of that; with `vertexColors` the light of the paper is multiplied into
 *   its colours
 * @property {boolean} [light] whether what stands on the sheet is lit as the paper is, casts its shadow on it, and is hidden by what lies
 *   before the paper; default false
 */

/**
 * The surface of a target. It has its place in the camera's frame: add it to the scene, or to the camera if that is moved. A unit is a
 * millimetre; a print of unknown size is shown as if it were 200 mm wide.
 */
export class Sheet extends Group {
  /** @type {{ vertices: VertexLight, covering: MaskCovering | PrintCovering, colors: BufferAttribute } | null} */
  #shading = null;
  /** @type {Mesh | null} */
  #shadow = null;
  /** @type {Mesh | null} */
  #cover = null;

  /**
   * @param {Target} target
   * @param {SheetOptions} [options] without a print the sheet is seen as it is, and only hides what is behind it
   */
  constructor(target, { map, material, light = false } = {}) {
    super();
    /** What it shows. */
    this.target = target;
    this.name = target.name;
    this.visible = false;
    if (target.unit === "width") this.scale.setScalar(1 / (target.mesh.perMm ?? 1));
    /** What all of it is drawn from, updated in place. */
    this.geometry = new SurfaceGeometry(target.mesh);
    /** Draws nothing, and hides what is behind the sheet: both sides do. */
    this.occluder = this.#layer(new MeshBasicMaterial({ colorWrite: false, side: DoubleSide, ...BEHIND }), ORDER.occluder);
    /** What is printed on it; null for none. The blank back stays as the camera sees it. */
    this.paper = /** @type {Mesh | null} */ (null);
    if (material) this.material = material;
    if (map) this.map = map;
    /** The light on what stands on it, where `light` asks for it. @type {PaperLight | null} */
    this.light = light ? new PaperLight() : null;
    if (!this.light) return;
    this.add(this.light);
    this.#shade();
    this.#cover = this.#layer(coverMaterial(), ORDER.cover);
    this.#shadow = this.#layer(new ShadowMaterial({ transparent: true, depthWrite: false }), ORDER.shadow);
    this.#shadow.visible = false;
  }

  /** The new print; null for none. Setting it takes the place of the print before, whose texture stays the page's. */
  get map() {
    return /** @type {MeshBasicMaterial | undefined} */ (this.paper?.material)?.map ?? null;
  }

  /** @param {Texture | null} map */
  set map(map) {
    this.material = map && new MeshBasicMaterial({ map, vertexColors: true, transparent: true, depthWrite: false, toneMapped: false });
  }

  /** What its paper is drawn with; null for nothing. Setting it disposes of the material before. @returns {Material | null} */
  get material() {
    return /** @type {Material | undefined} */ (this.paper?.material) ?? null;
  }

  /** @param {Material | null} material */
  set material(material) {
    this.material?.dispose();
    this.paper?.removeFromParent();
    this.paper = material && this.#layer(material, ORDER.paper);
    if (material?.vertexColors) this.#shade();
  }

  /**
   * An object whose pose follows a place on the sheet.
   *
   * @param {number} u from the print's left border to its right, 0 to 1
   * @param {number} v from its top to its bottom
   * @param {AnchorOptions} [options]
   * @returns {Anchor} a child of the sheet: `sheet.remove(anchor)` lets it go
   * @throws {DeepSftError} `invalid-argument` where the target has no surface
   * @throws {DeepSftError} `target-unusable` for a length in `mm` or `m` on a print of unknown size
   */
  anchor(u, v, options) {
    const anchor = new Anchor(this.target, u, v, { shadows: this.light !== null, ...options });
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
      this.#shading?.covering.reset();
      this.light?.reset();
      for (const anchor of this.#anchors()) anchor.lose();
      return;
    }
    const { mesh } = seen;
    this.show(mesh, atMs);
    const { number, camera, frame } = tracked;
    if (!frame) return;
    const anchors = this.#anchors();
    if (this.#shadow) this.#shadow.visible = anchors.length > 0;
    // A print leaves out by itself what is covered.
    if (this.#cover) this.#cover.visible = anchors.length > 0 || this.map === null;
    if (!this.#shading || (!this.paper && anchors.length === 0)) return;
    const { vertices, covering, colors } = this.#shading;
    const isCertain = seen.correlation >= MIN_CORRELATION;
    const uncovered = covering instanceof MaskCovering ? covering.follow(number, mesh, isCertain) : covering.follow(mesh, isCertain);
    const light = vertices.of(mesh.vertices, uncovered, camera, smallPixels(frame));
    for (let i = 0; i < light.length; i++) {
      colors.setXYZW(i, light[i], light[i], light[i], gentleRamp(uncovered[i], SEEN));
    }
    colors.needsUpdate = true;
    if (!this.light || !this.#shadow) return;
    this.light.follow(light, mesh.normals, uncovered, atMs);
    this.light.shineOn(anchors);
    // What multiplies linear light, as the opacity of black over sRGB.
    /** @type {ShadowMaterial} */ (this.#shadow.material).opacity = 1 - this.light.shade ** (1 / 2.2);
  }

  /**
   * Takes the shape of a mesh, as a single image gives it.
   *
   * @param {SurfaceMesh} mesh of the same target
   * @param {number} [atMs]
   * @throws {DeepSftError} `invalid-argument` for the mesh of another target
   */
  show(mesh, atMs = performance.now()) {
    this.geometry.update(mesh);
    for (const anchor of this.#anchors()) anchor.follow(this.geometry, atMs);
    this.visible = true;
  }

  /**
   * Takes over what a model's network says of what covers the sheet in a frame: `onEstimate` of a session.
   *
   * @param {Estimate} estimate
   * @param {number} frame its number
   */
  answer(estimate, frame) {
    const { covering } = this.#shading ?? {};
    if (covering instanceof MaskCovering) covering.answer(frame, estimate);
  }

  /** Lets geometry, materials and shadow go; a print's texture stays the page's. */
  dispose() {
    this.geometry.dispose();
    this.light?.directed.dispose();
    for (const child of this.children) if (child instanceof Mesh) /** @type {Material} */ (child.material).dispose();
  }

  #anchors() {
    return this.children.filter((child) => child instanceof Anchor);
  }

  /**
   * @param {Material} material
   * @param {number} order
   */
  #layer(material, order) {
    const mesh = new Mesh(this.geometry, material);
    mesh.renderOrder = order;
    mesh.receiveShadow = order >= ORDER.paper;
    this.add(mesh);
    return mesh;
  }

  /** From now on its vertices have colours: the light on them, and how far they are seen. */
  #shade() {
    if (this.#shading) return;
    const { target } = this;
    const { count } = this.geometry.getAttribute("position");
    const colors = new BufferAttribute(new Float32Array(4 * count).fill(1), 4).setUsage(DynamicDrawUsage);
    this.geometry.setAttribute("color", colors);
    const vertices = new VertexLight(target.mesh, new TemplateLight(target.texture));
    this.#shading = { vertices, covering: target.kind === "model" ? new MaskCovering() : new PrintCovering(target), colors };
  }
}

/** Writes the depth of what is nearest, where something lies before the sheet: it hides all that stands there. */
function coverMaterial() {
  return new ShaderMaterial({
    vertexShader: `
attribute vec4 color;
varying float v_shown;
void main() {
  v_shown = color.a;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_Position.z = -gl_Position.w;
}`,
    fragmentShader: `
varying float v_shown;
void main() {
  if (v_shown > 0.5) discard;
  gl_FragColor = vec4(0.0);
}`,
    colorWrite: false,
  });
}
