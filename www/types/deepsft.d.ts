import { EngineWorker } from "./engine/engine-worker.js";
import { Estimate } from "./results/estimate.js";
import { MeshTracking } from "./tracking/mesh-tracking.js";
import { Tracking } from "./tracking/tracking.js";
import type { LoadProgress } from "./engine/bundle.js";
import type { EngineInfo, EngineTemplate, MeshTopology, StartRequest } from "./engine/engine-worker.js";
import type { ImageInput } from "./frames/image-input.js";
import type { CameraOption } from "./camera/intrinsics.js";
import type { TrackedFrame } from "./results/tracked-frame.js";
import type { Smoothing } from "./tracking/tracker-worker.js";
export type LoadOptions = {
    /**
     * `auto` (the default) takes WebGPU when a real GPU offers what the engine
     * needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
     */
    device?: "auto" | "webgpu" | "cpu";
    onProgress?: (progress: LoadProgress) => void;
    /**
     * stops loading; the promise then rejects with the signal's reason
     */
    signal?: AbortSignal;
    /**
     * address of `deepsft_web_bg.wasm`, where a bundler moved it
     */
    wasmUrl?: string | URL;
    /**
     * address of `worker.js`, where a bundler moved it
     */
    workerUrl?: string | URL;
    /**
     * so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
     * hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
     */
    timeoutMs?: number;
};
export type EstimateOptions = {
    /**
     * estimated when absent
     */
    camera?: CameraOption;
    /**
     * fits the template's mesh to the image, starting from the network's maps,
     * and gives the maps of that mesh; where it explains the image no better the network's own stay. Default false.
     */
    fit?: boolean;
};
export type TrackMeshOptions = {
    /**
     * estimated when absent
     */
    camera?: CameraOption;
    /**
     * a One-Euro filter of each vertex, for content that must not tremble; `true`
     * takes its defaults. Default: none.
     */
    smooth?: boolean | Smoothing;
    /**
     * is given each answer of the network, with the number of
     * its frame, and owns it: call its `close()` when done
     */
    onEstimate?: (estimate: Estimate, frame: number) => void;
};
export type StartPlan = {
    request: StartRequest;
    workerUrl: URL | undefined;
    timeoutMs: number | undefined;
};
/** Shape from template on a worker of its own. */
export declare class DeepSft {
    #private;
    /**
     * Use {@link DeepSft.load}.
     *
     * @param {StartPlan} plan
     * @param {{ worker: EngineWorker, info: EngineInfo, template: EngineTemplate }} started
     */
    constructor(plan: StartPlan, { worker, info, template }: {
        worker: EngineWorker;
        info: EngineInfo;
        template: EngineTemplate;
    });
    /**
     * Fetches a model and starts the engine on it.
     *
     * @param {string | URL} url folder of the model, relative to the page
     * @param {LoadOptions} [options]
     * @returns {Promise<DeepSft>}
     * @throws {DeepSftError} `engine-load`, `model-load`, `model-corrupt`, `model-version`, `webgpu-unavailable`, `gpu-lost`
     */
    static load(url: string | URL, { device, onProgress, signal, wasmUrl, workerUrl, timeoutMs }?: LoadOptions): Promise<DeepSft>;
    /** What runs the network, and where. */
    get info(): EngineInfo;
    /**
     * The template's picture, its size in mm, and what of its mesh no frame changes.
     *
     * @returns {{ texture: ImageData, widthMm: number, heightMm: number, mesh: MeshTopology }}
     */
    get template(): {
        texture: ImageData;
        widthMm: number;
        heightMm: number;
        mesh: MeshTopology;
    };
    /**
     * Registers and measures the template in one image.
     *
     * @param {ImageInput} image
     * @param {EstimateOptions} [options]
     * @returns {Promise<Estimate>}
     * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`, `camera-intrinsics`, `gpu-lost`, `closed`
     */
    estimate(image: ImageInput, options?: EstimateOptions): Promise<Estimate>;
    /**
     * The same for a video. One frame is in flight at a time and the newest one wins: called while a frame is under
     * way, this waits and then takes the frame the video shows at that moment; called again before that, the earlier
     * call resolves to null.
     *
     * @param {HTMLVideoElement | VideoFrame | HTMLCanvasElement | OffscreenCanvas} video
     * @param {EstimateOptions} [options]
     * @returns {Promise<Estimate | null>} null when a newer call took its place
     * @throws {DeepSftError} as {@link DeepSft.estimate}
     */
    estimateForVideo(video: HTMLVideoElement | VideoFrame | HTMLCanvasElement | OffscreenCanvas, options?: EstimateOptions): Promise<Estimate | null>;
    /**
     * Estimates frame after frame of a video, each newest one, until stopped.
     *
     * @param {HTMLVideoElement} video
     * @param {(estimate: Estimate) => void} onEstimate owns the estimate: call its `close()` when done
     * @param {EstimateOptions} [options]
     * @returns {Tracking}
     */
    track(video: HTMLVideoElement, onEstimate: (estimate: Estimate) => void, options?: EstimateOptions): Tracking;
    /**
     * Follows the template's mesh through a video at the camera's rate: a tracker in a worker of its own takes each newest
     * frame, and the network, beside it and at its own rate, tells it where to start, confirms it, and finds the
     * template again when it was lost.
     *
     * @param {HTMLVideoElement} video
     * @param {(tracked: TrackedFrame) => void} onTracked owns the frame: call its `close()` when done
     * @param {TrackMeshOptions} [options]
     * @returns {MeshTracking}
     * @throws {DeepSftError} `closed`, `engine-load`
     * @throws {RangeError} for a `smooth` that is none
     */
    trackMesh(video: HTMLVideoElement, onTracked: (tracked: TrackedFrame) => void, { camera, smooth, onEstimate }?: TrackMeshOptions): MeshTracking;
    /** Stops the worker and lets everything go; what is under way rejects with `closed`. */
    close(): void;
}
