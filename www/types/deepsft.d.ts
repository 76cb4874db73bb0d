import { LastingEngine } from "./engine/lasting-engine.js";
import { Scan } from "./targets/scan.js";
import { Target } from "./targets/target.js";
import { Session } from "./tracking/session.js";
import type { CameraOption, Estimate, EstimateOptions, FlatPrint, FlattenOptions, FrameSource, ImageInput, LoadProgress, ScanInput, Smoothing, TemplateInput } from "./index.js";
import type { ModelInput } from "./engine/bundle.js";
export type LoadOptions = {
    /**
     * `auto` (the default) takes WebGPU when a real GPU offers what the engine
     * needs, else the CPU, and says why in `info.fallback`; `webgpu` takes any adapter, even an emulated one, or fails
     */
    device?: "auto" | "webgpu" | "cpu";
    onProgress?: (progress: LoadProgress) => void;
    /**
     * whether this browser keeps the model's files, in its Cache storage by their SHA-256, so that the next visit
     * asks for `model.json` alone; default true. Where there is no such storage, or no room, they are fetched each time.
     */
    keep?: boolean;
    /**
     * of the requests for the model's files, as of a server that asks who it is
     */
    headers?: HeadersInit;
    /**
     * stops loading; the promise then rejects with the signal's reason
     */
    signal?: AbortSignal;
    /**
     * address of a copy of this package's folder `dist`, whose worker and engine are taken, where a bundler does
     * not find them
     */
    baseUrl?: string | URL;
    /**
     * so long, in milliseconds, the engine may be silent while it is waited for, before it counts as
     * hung and everything rejects with `internal`; default 180,000, since the first frame on an emulated GPU takes minutes
     */
    timeoutMs?: number;
};
export type PictureOptions = {
    /**
     * width of the print, without the paper's margins; 5 to 20,000. Without it lengths are counted in that width,
     * and the target's `unit` is `width`.
     */
    widthMm?: number;
    /**
     * its height; by the picture's sides when absent
     */
    heightMm?: number;
    /**
     * diameter of the tin, bottle, mug or tube that the print goes around; it needs `widthMm`. A print longer
     * than one turn covers its own end. When absent the print lies flat at rest.
     */
    aroundMm?: number;
    /**
     * how many copies of the print `follow` follows at once, up to 16; each takes the finders about as long again.
     * Default 1
     */
    copies?: number;
    /**
     * for people; the file's own for a File and an address
     */
    name?: string;
    /**
     * rejects with its reason, and no target is added
     */
    signal?: AbortSignal;
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
    estimate(image: ImageInput, options?: EstimateOptions): Promise<Estimate>;
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
    flatten(image: ImageInput, options?: FlattenOptions): Promise<FlatPrint | null>;
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
