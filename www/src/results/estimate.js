// What an estimate holds.

import { DeepSftError } from "../error.js";
import { SurfaceMesh } from "./surface-mesh.js";

/** @import { SourcedCamera, Target } from "../index.js" */
/** @import { RawMesh } from "../../pkg/deepsft_web.js" */
/** @import { MeshRequest, RawEstimate } from "../engine/engine-worker.js" */

/**
 * Milliseconds spent on a frame: `capture` (grabbing it and reading its pixels), `warp` (to the canonical image, for a network),
 * `network`, `judge` (confidence), `features` (finding a picture, warp and fit included), `fit` (of a mesh to what
 * the network found, where it was asked for), and `total`, from the call to the result.
 *
 * @typedef {Record<`${"capture" | "warp" | "network" | "judge" | "features" | "fit" | "total"}Ms`, number>} EstimateTimes
 */

/**
 * A map on the pixels of the canonical image (480 columns and 270 rows, of an upright frame 270 columns and 480 rows), row-major,
 * `channels` values per pixel.
 *
 * @template {Float32Array | Uint8Array} A
 */
export class EstimateMap {
  /** @type {A | null} */
  #values;

  /**
   * @param {A} values
   * @param {number} width
   * @param {number} channels
   */
  constructor(values, width, channels) {
    this.#values = values;
    /** Columns. */
    this.width = width;
    /** Rows. */
    this.height = values.length / channels / width;
    /** Values per pixel. */
    this.channels = channels;
    /**
     * Where the values live.
     *
     * @type {"cpu"}
     */
    this.location = "cpu";
  }

  /**
   * The values themselves, not a copy.
   *
   * @throws {DeepSftError} `closed`
   */
  values() {
    if (this.#values === null) throw new DeepSftError("closed", "This map was used after close().");
    return this.#values;
  }

  /**
   * A copy of the values.
   *
   * @throws {DeepSftError} `closed`
   */
  toFloat32Array() {
    return Float32Array.from(this.values());
  }

  /** Lets the memory go. */
  close() {
    this.#values = null;
  }
}

/** What one frame shows of a target. */
export class Estimate {
  #makeMesh;
  /** By method. @type {Map<"fit" | "completion", Promise<RawMesh | null>>} */
  #meshes = new Map();

  /**
   * @param {RawEstimate} raw
   * @param {SourcedCamera} camera
   * @param {EstimateTimes} times
   * @param {Target} target
   * @param {(request: MeshRequest) => Promise<RawMesh | null>} makeMesh has the engine fit or complete a mesh
   */
  constructor(raw, camera, times, target, makeMesh) {
    this.#makeMesh = makeMesh;
    if (raw.fitted) this.#meshes.set("fit", Promise.resolve(raw.fitted));
    /** What was looked for. */
    this.target = target;
    /** Whether the target was found; when not, the maps are best ignored. */
    this.found = raw.found;
    /**
     * How well image and registered target agree, 0 to 1. Of the network's maps: photo-consistency. Of a picture: the fraction of the
     * visible print that the image confirms; docs/targets.md says from where on it counts as found.
     */
    this.confidence = raw.confidence;
    /** Whether the image determines the whole shape, and not only that the target is there: its depth is to be believed. */
    this.shapeDetermined = raw.shapeDetermined;
    /** What gave the maps: the model's network, or the features of a picture; null when nothing was seen. */
    this.by = raw.by;
    /** Distance along the optical axis, mm (or in the target's `unit`); -1 outside the object. */
    this.depth = new EstimateMap(scaledDepth(raw.depth, target.mesh.perMm), raw.width, 1);
    /** Texture position (u, v) in the unit square, v down; (-1, -1) outside the object. */
    this.registration = new EstimateMap(raw.registration, raw.width, 2);
    /** 1 where the object is seen, else 0. */
    this.mask = new EstimateMap(raw.mask, raw.width, 1);
    /** Whether depth and registration are those of a mesh fitted to the image; else they are the finder's own. */
    this.fitted = raw.fitted !== null;
    /**
     * Focal length of the canonical image, pixels: `CANONICAL_FOCAL`, or shorter where the target is too near for that. The functions between
     * the canonical image and the camera's take it.
     */
    this.focal = raw.focal;
    /** The canonical image the maps belong to. */
    this.canonical = new ImageData(new Uint8ClampedArray(raw.canonical), raw.width);
    /** The camera that was used, with its source. */
    this.camera = camera;
    /** Milliseconds spent on it. */
    this.times = times;
    /** The frame the maps belong to; null when it was given as ImageData. Closed by `close()`. */
    this.frame = raw.bitmap;
  }

  /**
   * The whole surface, hidden parts included, computed once per method.
   *
   * `fit` (the default) fits the target's mesh to this image. `completion` is the paper's way: visible vertices stay about where the
   * finder has them and the others follow as rigidly as possible.
   *
   * @param {{ method?: "fit" | "completion" }} [options]
   * @returns {Promise<SurfaceMesh | null>} null when nothing was found, or too little of it
   * @throws {DeepSftError} `closed`, `gpu-lost`, `internal`
   */
  async completeMesh({ method = "fit" } = {}) {
    if (!this.found) return null;
    // Before anything is waited for: close() may be called meanwhile.
    const depth = scaledDepth(this.depth.values(), 1 / (this.target.mesh.perMm ?? 1));
    const maps = { id: this.target.id, width: this.depth.width, focal: this.focal, depth, registration: this.registration.values() };
    const made = this.#meshes.get(method) ?? this.#makeMesh({ ...maps, canonical: method === "fit" ? this.canonical.data : null });
    this.#meshes.set(method, made);
    made.catch(() => this.#meshes.delete(method));
    const raw = await made;
    return raw && new SurfaceMesh(raw.surface, this.target.mesh, method);
  }

  /** Lets the maps and the frame go. */
  close() {
    this.depth.close();
    this.registration.close();
    this.mask.close();
    this.frame?.close();
    this.frame = null;
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }
}

/**
 * Depths in another unit; those outside stay -1.
 *
 * @param {Float32Array} depth
 * @param {number} [scale]
 */
export function scaledDepth(depth, scale = 1) {
  return scale === 1 ? depth : depth.map((d) => (d < 0 ? d : scale * d));
}
