import { LastingEngine } from "./engine/lasting-engine.js";
import { Estimate } from "./results/estimate.js";
import { Scan } from "./targets/scan.js";
import { Target } from "./targets/target.js";
import { Session } from "./tracking/session.js";
import type { CameraOption, FrameSource, ImageInput, LoadOptions, PictureOptions, ScanInput, Smoothing, TemplateInput } from "./index.js";
import type { ModelInput } from "./engine/bundle.js";
export type EstimateOptions = {
    /**
     * what to look for; when absent the model's own target, else the only one there is
     */
    target?: Target;
    /**
     * when absent what a photograph's EXIF data tell, if the image is a Blob or File with some; else
     * estimated. Either way a tilted or bent sheet tells it better, and then `estimate.camera.source` is `calibrated`
     */
    camera?: CameraOption;
    /**
     * rejects at once with its reason
     */
    signal?: AbortSignal;
    /**
     * fits the target's mesh to the image, starting from the network's maps,
     * and gives the maps of that mesh; where it explains the image no better the network's own stay. Default false. What is found
     * by its features is fitted in any case.
     */
    fit?: boolean;
};
export type FlattenOptions = {
    /**
     * pixels of the flat print, 16 to 4096; default 1024. Its height follows.
     */
    width?: number;
    /**
     * divides shadows, uneven light and its colour out of it; what is written on the print stays. Default false
     */
    unshaded?: boolean;
    /**
     * as for `estimate`
     */
    target?: Target;
    /**
     * as for `estimate`
     */
    camera?: CameraOption;
    /**
     * rejects at once with its reason
     */
    signal?: AbortSignal;
};
export type FlatPrint = {
    image: ImageData;
    confidence: Float32Array;
};
export type FollowOptions = {
    /**
     * what to follow; when absent all there are, also those that are added later. With none the frames
     * are given all the same.
     */
    targets?: Iterable<Target>;
    /**
     * when absent that of the `CameraStream`, else estimated
     */
    camera?: CameraOption;
    /**
     * whether the focal length is looked for where it is not known well: it is told as `focal`, and a `CameraStream`
     * is calibrated with it. Default: of a `CameraStream` true, else false. Depth is off by as much as the focal length is.
     */
    calibrate?: boolean;
    /**
     * a One-Euro filter of each vertex, for content that must not tremble; `true`
     * takes its defaults. Default: none.
     */
    smooth?: boolean | Smoothing;
    /**
     * whether the browser draws with the processor, for it has no GPU: frames are then read from the video's
     * memory where they lie there, rather than drawn. Default false.
     */
    software?: boolean;
    /**
     * ends the session; the loop over its frames then throws the signal's reason
     */
    signal?: AbortSignal;
    /**
     * is given each answer of the model's network, with the number
     * of its frame, and owns it: call its `close()` when done
     */
    onEstimate?: (estimate: Estimate, frame: number) => void;
};
/** Shape from template on a worker of its own. */
export declare class DeepSft {
    #private;
    /**
     * Use {@link DeepSft.load}.
     *
     * @param {LastingEngine} engine
     */
    constructor(engine: LastingEngine);
    /**
     * Starts the engine, on a model that is fetched, or without one, for pictures alone: these need no training, no network and no
     * GPU.
     *
     * @param {ModelInput | null} [model]
     * @param {LoadOptions} [options]
     * @throws {DeepSftError} `browser-unsupported`, `engine-load`, `model-load`, `model-corrupt`, `model-version`, `webgpu-unavailable`,
     *   `gpu-lost`
     */
    static load(model?: ModelInput | null, { device, keep, headers, onProgress, signal, baseUrl, timeoutMs }?: LoadOptions): Promise<DeepSft>;
    /** What runs the network, and where. Without a model: what looks for pictures. */
    get info(): import("./engine/engine-worker.js").EngineInfo;
    /**
     * All that can be looked for, the model's own target first.
     *
     * @returns {Target[]}
     */
    get targets(): Target[];
    /**
     * Makes a target of a picture that is printed on something that bends. Nothing is trained.
     *
     * Transparent parts count as white paper, large pictures are made smaller. The same pixels twice are refused: two targets
     * with one picture cannot be told apart. `alike` of the answer names the targets that it resembles.
     *
     * @param {ImageInput} image
     * @param {PictureOptions} [options]
     * @returns {Promise<Target>}
     * @throws {DeepSftError} `target-unusable`, `image-unreadable`, `image-cross-origin`, `closed`, `invalid-argument` for a number of copies
     *   that is none
     */
    addPicture(image: ImageInput, options?: PictureOptions): Promise<Target>;
    /**
     * Makes a target of a template's folder, as `deepsft template` writes it: a sheet or an object with a volume, found like a picture.
     *
     * @param {TemplateInput} input address of the folder, relative to the page, or its files
     * @param {{ name?: string }} [options]
     * @throws {DeepSftError} `model-load`, `model-version`, `target-unusable`, `closed`
     */
    addTemplate(input: TemplateInput, { name }?: {
        name?: string;
    }): Promise<Target>;
    /**
     * Reads a scan: its shape, its texture, and the flat sheet it unrolls to. Scans of bent sheets, labels and plates unroll; what has a
     * volume does not.
     *
     * @param {ScanInput} input
     * @param {{ mmPerUnit?: number }} [options] millimetres of the file's unit; default 1000 for glTF, which counts in metres, and 1 for OBJ and PLY,
     *   which do not say
     * @throws {DeepSftError} `model-load`, `target-unusable`, `closed`
     */
    readScan(input: ScanInput, { mmPerUnit }?: {
        mmPerUnit?: number;
    }): Promise<Scan>;
    /**
     * Makes a target of a scan: of the flat sheet that it unrolls to, found and followed like a picture, or of the object with its volume.
     *
     * @param {Scan | ScanInput} input
     * @param {{ widthMm?: number, mmPerUnit?: number, name?: string }} [options] width of the flat sheet, where the scan's is not right; as for
     *   {@link DeepSft.readScan}; a name for people
     * @returns {Promise<Target>} of the kind `picture` or, with a volume, `template`
     * @throws {DeepSftError} as {@link DeepSft.readScan} and {@link DeepSft.addPicture}; `target-unusable` for the width of what is no sheet
     */
    addScan(input: Scan | ScanInput, { widthMm, mmPerUnit, name }?: {
        widthMm?: number;
        mmPerUnit?: number;
        name?: string;
    }): Promise<Target>;
    /**
     * Looks for a target no longer, also where it is being followed.
     *
     * @param {Target} target one that was added; the model's own stays
     * @throws {DeepSftError} `target-unknown`, `target-unusable`
     */
    removeTarget(target: Target): void;
    /**
     * Registers and measures a target in one image.
     *
     * @param {ImageInput} image
     * @param {EstimateOptions} [options]
     * @throws {DeepSftError} `target-unknown`, `image-unreadable`, `image-cross-origin`, `camera-intrinsics`, `gpu-lost`, `closed`
     */
    estimate(image: ImageInput, { fit, ...options }?: EstimateOptions): Promise<Estimate>;
    /**
     * Lays a print flat as one image shows it: found, fitted to the image's own pixels, and each place of the print looked up in the image.
     * For forms, labels, drawings on a print.
     *
     * @param {ImageInput} image
     * @param {FlattenOptions} [options]
     * @returns {Promise<FlatPrint | null>} null where the print is not found
     * @throws {DeepSftError} as `estimate`
     * @throws {DeepSftError} `invalid-argument` for a width that is none
     */
    flatten(image: ImageInput, { width, unshaded, ...options }?: FlattenOptions): Promise<FlatPrint | null>;
    /**
     * Follows the meshes of targets through a video at the camera's rate: a tracker in a worker of its own takes each newest
     * frame, and the finders, beside it and at their own rate, tell it where to start, confirm it, and find
     * targets again that were lost.
     *
     * @param {FrameSource} source
     * @param {FollowOptions} [options]
     * @returns {Session} of frames, to be iterated: `for await (const frame of session)`
     * @throws {DeepSftError} `closed`, `engine-load`, `target-unknown`
     * @throws {DeepSftError} `invalid-argument` for a `smooth` that is none
     */
    follow(source: FrameSource, { targets: wanted, smooth, signal, ...options }?: FollowOptions): Session;
    /** Stops the worker and lets everything go; what is under way rejects with `closed`. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
}
