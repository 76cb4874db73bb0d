import { EngineWorker } from "./engine.js";
import { Estimate } from "./estimate.js";
import { Tracking } from "./tracking.js";
import type { LoadProgress } from "./bundle.js";
import type { EngineInfo, EngineTemplate, StartRequest } from "./engine.js";
import type { ImageInput } from "./image-input.js";
import type { Camera, CameraSource } from "./intrinsics.js";
export type CameraOption = (Camera & {
    source?: CameraSource;
}) | ((width: number, height: number) => Camera & {
    source?: CameraSource;
});
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
};
export type EstimateOptions = {
    camera?: CameraOption;
};
export type StartPlan = {
    request: StartRequest;
    workerUrl: URL | undefined;
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
    static load(url: string | URL, { device, onProgress, signal, wasmUrl, workerUrl }?: LoadOptions): Promise<DeepSft>;
    /** What runs the network, and where. */
    get info(): EngineInfo;
    /**
     * The template's picture and its size in mm.
     *
     * @returns {{ texture: ImageData, widthMm: number, heightMm: number }}
     */
    get template(): {
        texture: ImageData;
        widthMm: number;
        heightMm: number;
    };
    /**
     * Registers and measures the template in one image.
     *
     * @param {ImageInput} image
     * @param {EstimateOptions} [options]
     * @returns {Promise<Estimate>}
     * @throws {DeepSftError} `image-unreadable`, `camera-intrinsics`, `gpu-lost`, `closed`
     */
    estimate(image: ImageInput, { camera }?: EstimateOptions): Promise<Estimate>;
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
    estimateForVideo(video: HTMLVideoElement | VideoFrame | HTMLCanvasElement | OffscreenCanvas, { camera }?: EstimateOptions): Promise<Estimate | null>;
    /**
     * Estimates frame after frame of a video, each newest one, until stopped.
     *
     * @param {HTMLVideoElement} video
     * @param {(estimate: Estimate) => void} onEstimate owns the estimate: call its `close()` when done
     * @param {EstimateOptions} [options]
     * @returns {Tracking}
     */
    track(video: HTMLVideoElement, onEstimate: (estimate: Estimate) => void, options?: EstimateOptions): Tracking;
    /** Stops the worker and lets everything go; what is under way rejects with `closed`. */
    close(): void;
}
