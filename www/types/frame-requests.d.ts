import { Estimate } from "./results/estimate.js";
import type { CameraOption, ImageInput, Target } from "./index.js";
import type { LastingEngine } from "./engine/lasting-engine.js";
import type { Question } from "./tracking/session.js";
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
/** Has the engine look at frames, one at a time. */
export declare class FrameRequests {
    #private;
    /**
     * @param {LastingEngine} engine
     * @param {(target: Target | undefined) => Target} chosen gives the target that is meant, or throws
     */
    constructor(engine: LastingEngine, chosen: (target: Target | undefined) => Target);
    /**
     * @param {ImageInput} image
     * @param {EstimateOptions} options
     */
    estimate(image: ImageInput, { fit, signal, ...options }: EstimateOptions): Promise<Estimate>;
    /**
     * @param {ImageInput} image
     * @param {FlattenOptions} options
     * @returns {Promise<FlatPrint | null>}
     */
    flatten(image: ImageInput, { width, unshaded, signal, ...options }: FlattenOptions): Promise<FlatPrint | null>;
    /**
     * Has the finders look for targets in a frame.
     *
     * @param {Question} question
     * @param {boolean} estimated whether the network's answer is wanted as an estimate too
     */
    find({ ids, frame, canonical, camera, focal }: Question, estimated: boolean): Promise<{
        answers: {
            id: number;
            sightings: Float32Array[];
        }[];
        estimate: null;
    } | {
        answers: {
            id: number;
            sightings: Float32Array[];
        }[];
        estimate: Estimate;
    }>;
}
