import { SurfaceMesh } from "./surface-mesh.js";
import type { SourcedCamera, Target } from "../index.js";
import type { RawMesh } from "../../pkg/deepsft_web.js";
import type { MeshRequest, RawEstimate } from "../engine/engine-worker.js";
export type EstimateTimes = Record<`${"capture" | "warp" | "network" | "judge" | "features" | "fit" | "total"}Ms`, number>;
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
export declare class EstimateMap<A extends Float32Array | Uint8Array> {
    #private;
    /** Columns. */
    width: number;
    /** Rows. */
    height: number;
    /** Values per pixel. */
    channels: number;
    /**
     * Where the values live.
     *
     * @type {"cpu"}
     */
    location: "cpu";
    /**
     * @param {A} values
     * @param {number} width
     * @param {number} channels
     */
    constructor(values: A, width: number, channels: number);
    /**
     * The values themselves, not a copy.
     *
     * @throws {DeepSftError} `closed`
     */
    values(): A;
    /**
     * A copy of the values.
     *
     * @throws {DeepSftError} `closed`
     */
    toFloat32Array(): Float32Array<ArrayBuffer>;
    /** Lets the memory go. */
    close(): void;
}
/** What one frame shows of a target. */
export declare class Estimate {
    #private;
    /** What was looked for. */
    target: Target;
    /** Whether the target was found; when not, the maps are best ignored. */
    found: boolean;
    /**
     * How well image and registered target agree, 0 to 1. Of the network's maps: photo-consistency. Of a picture: the fraction of the
     * visible print that the image confirms; docs/targets.md says from where on it counts as found.
     */
    confidence: number;
    /** Whether the image determines the whole shape, and not only that the target is there: its depth is to be believed. */
    shapeDetermined: boolean;
    /** What gave the maps: the model's network, or the features of a picture; null when nothing was seen. */
    by: "features" | "network" | null;
    /** Distance along the optical axis, mm (or in the target's `unit`); -1 outside the object. */
    depth: EstimateMap<Float32Array<ArrayBufferLike>>;
    /** Texture position (u, v) in the unit square, v down; (-1, -1) outside the object. */
    registration: EstimateMap<Float32Array<ArrayBufferLike>>;
    /** 1 where the object is seen, else 0. */
    mask: EstimateMap<Uint8Array<ArrayBufferLike>>;
    /** Whether depth and registration are those of a mesh fitted to the image; else they are the finder's own. */
    fitted: boolean;
    /**
     * Focal length of the canonical image, pixels: `CANONICAL_FOCAL`, or shorter where the target is too near for that. The functions between
     * the canonical image and the camera's take it.
     */
    focal: number;
    /** The canonical image the maps belong to. */
    canonical: ImageData;
    /** The camera that was used, with its source. */
    camera: import("../camera/intrinsics.js").SourcedCamera;
    /** Milliseconds spent on it. */
    times: EstimateTimes;
    /** The frame the maps belong to; null when it was given as ImageData. Closed by `close()`. */
    frame: ImageBitmap | null;
    /**
     * @param {RawEstimate} raw
     * @param {SourcedCamera} camera
     * @param {EstimateTimes} times
     * @param {Target} target
     * @param {(request: MeshRequest) => Promise<RawMesh | null>} makeMesh has the engine fit or complete a mesh
     */
    constructor(raw: RawEstimate, camera: SourcedCamera, times: EstimateTimes, target: Target, makeMesh: (request: MeshRequest) => Promise<RawMesh | null>);
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
    completeMesh({ method }?: {
        method?: "fit" | "completion";
    }): Promise<SurfaceMesh | null>;
    /** Lets the maps and the frame go. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
}
/**
 * Depths in another unit; those outside stay -1.
 *
 * @param {Float32Array} depth
 * @param {number} [scale]
 */
export declare function scaledDepth(depth: Float32Array, scale?: number): Float32Array<ArrayBufferLike>;
