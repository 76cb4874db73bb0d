import { Announcer } from "../announcer.js";
import { CameraStream } from "../camera/camera-stream.js";
import { TrackedFrame } from "../results/tracked-frame.js";
import type { Estimate, FollowOptions, OwnFrame, Smoothing, SourcedCamera, StallReason, Target } from "../index.js";
import type { RawAnswer, TargetRequest } from "../engine/engine-worker.js";
import type { TrackerWorker } from "./tracker-host.js";
export type FrameSource = HTMLVideoElement | CameraStream | AsyncIterable<OwnFrame>;
export type FoundFocal = {
    width: number;
    height: number;
    focal: number;
    spread: number;
};
export type SessionEvents = {
    /**
     * a target, or a further copy of it, is found; told before the
     * frame is given
     */
    found: CustomEvent<{
        target: Target;
        copy: number;
        frame: TrackedFrame;
    }>;
    /**
     * it is found no longer; likewise
     */
    lost: CustomEvent<{
        target: Target;
        copy: number;
        frame: TrackedFrame;
    }>;
    /**
     * the camera's focal length, once the moving, bending sheet has given it away, to 1.5 % or better,
     * and again as it becomes surer, down to 0.5 %
     */
    focal: CustomEvent<FoundFocal>;
    /**
     * no frame came for three seconds
     */
    stalled: CustomEvent<{
        reason: StallReason;
    }>;
    /**
     * the system has taken the camera away for a while
     */
    interrupted: CustomEvent<null>;
    /**
     * the session is over: it was closed (`error` is null then), or why
     */
    ended: CustomEvent<{
        error: unknown;
    }>;
};
export type OwnParts = {
    targets: readonly Target[];
    /**
     * starts a worker, which is ended with the session
     */
    startTracker: () => TrackerWorker;
    module: WebAssembly.Module;
    smooth: Smoothing | null;
    sourceOf: (target: Target) => TargetRequest;
    find: (question: Question) => Promise<{
        answers: RawAnswer[];
        estimate: Estimate | null;
    }>;
};
export type SessionParts = OwnParts & Pick<FollowOptions, "camera" | "calibrate" | "software" | "signal" | "onEstimate">;
export type Question = {
    /**
     * of the targets to look for
     */
    ids: number[];
    /**
     * closed with the estimate, or when there is none
     */
    frame: ImageBitmap;
    /**
     * the canonical image where it is enough; closed with the answer
     */
    canonical: ImageBitmap | null;
    /**
     * of the frame
     */
    camera: SourcedCamera;
    /**
     * of the canonical image that is looked at, pixels
     */
    focal: number;
};
/**
 * Targets being followed through a video. It gives each frame that was followed:
 *
 * ```js
 * for await (const frame of sft.follow(camera)) draw(frame);
 * ```
 *
 * It works while it is iterated; leaving the loop closes it. A frame closes itself when the next one is asked for, unless
 * {@link TrackedFrame.keep} was called. {@link SessionEvents} has its events.
 *
 * @extends {Announcer<SessionEvents>}
 */
export declare class Session extends Announcer<SessionEvents> {
    #private;
    /**
     * Use `sft.follow`.
     *
     * @param {FrameSource} source
     * @param {SessionParts} parts
     */
    constructor(source: FrameSource, parts: SessionParts);
    /** What it follows. @returns {Target[]} */
    get targets(): Target[];
    /** Whether it is over. */
    get closed(): boolean;
    /** The frames, once: a second loop goes on where the first one is. */
    [Symbol.asyncIterator](): AsyncGenerator<TrackedFrame, void, void>;
    /** Ends it: the loop over its frames ends without an error. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
    /**
     * Follows a target too, from one of the next frames on.
     *
     * @param {Target} target
     * @throws {DeepSftError} `target-unknown`, `closed`
     */
    addTarget(target: Target): void;
    /**
     * Follows a target no longer. `lost` is not told of it.
     *
     * @param {Target} target one that is not followed is left alone
     */
    removeTarget({ id }: Target): void;
    /**
     * Depth and registration of a target's mesh in the newest frame, as in an `Estimate`: rows of `width` columns, -1 where the mesh is
     * not seen, and the focal length of the canonical image that they belong to.
     *
     * @param {Target} [target] the first when absent
     * @returns {Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>}
     * @throws {DeepSftError} `target-unknown`, `closed`
     */
    maps(target?: Target): Promise<{
        width: number;
        focal: number;
        depth: Float32Array;
        registration: Float32Array;
    }>;
}
