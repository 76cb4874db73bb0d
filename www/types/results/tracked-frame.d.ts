import type { SourcedCamera, SurfaceMesh, Target } from "../index.js";
export type TrackedTimes = {
    captureMs: number;
    warpMs: number;
    trackMs: number;
    totalMs: number;
};
/** @import { SourcedCamera, SurfaceMesh, Target } from "../index.js" */
/**
 * Milliseconds spent on a frame: `capture` (grabbing it and reading its pixels), `warp` (to the canonical image),
 * `track` (all targets), and `total`, from when the tracker was free for it to the result.
 *
 * @typedef {{ captureMs: number, warpMs: number, trackMs: number, totalMs: number }} TrackedTimes
 */
/** One target in one frame of a video. */
export declare class TrackedTarget {
    /** What is followed. */
    target: Target;
    /** Which copy of its print, from 0; others than 0 where `addPicture` was asked for `copies`. A copy keeps its number while it is followed. */
    copy: number;
    /**
     * Whether it is found: from when three frames in a row have confirmed its mesh, or one strongly, until none has for 0.4 s.
     */
    found: boolean;
    /** The whole surface, hidden parts included; null unless found. */
    mesh: SurfaceMesh | null;
    /** Whether this frame does not confirm the mesh: it stands where it was last confirmed, or about there. */
    held: boolean;
    /** Correlation of the normalised image with the normalised print over the visible sheet, 0 to 1. */
    correlation: number;
    /** Solver iterations this frame took. */
    iterations: number;
    /** @param {{ target: Target, copy?: number, mesh: SurfaceMesh | null, held: boolean, correlation: number, iterations: number }} contents */
    constructor({ target, copy, mesh, held, correlation, iterations }: {
        target: Target;
        copy?: number;
        mesh: SurfaceMesh | null;
        held: boolean;
        correlation: number;
        iterations: number;
    });
}
/** One frame of a video with the meshes in it. */
export declare class TrackedFrame {
    /** Counts the frames the tracker saw, from 1. */
    number: number;
    /** When it was shown, by the page's clock, or as it was given; milliseconds, ascending. */
    timeMs: number;
    /** What each target is in this frame, in the order in which they were given, and their further copies after them. */
    targets: TrackedTarget[];
    /** The camera that was used, with its source. */
    camera: import("../camera/intrinsics.js").SourcedCamera;
    /** Milliseconds spent on it. */
    times: TrackedTimes;
    /** Answers of the finders per second, by the time between the last two; 0 before. */
    networkFps: number;
    /** The frame the meshes belong to: draw over this one, not over what the video shows by now. Closed by `close()`. */
    frame: ImageBitmap | null;
    /** Whether it stays open when the next one is asked for. */
    kept: boolean;
    /** @param {{ number: number, timeMs: number, targets: TrackedTarget[], camera: SourcedCamera, times: TrackedTimes, networkFps: number, frame: ImageBitmap | null }} contents */
    constructor({ number, timeMs, targets, camera, times, networkFps, frame }: {
        number: number;
        timeMs: number;
        targets: TrackedTarget[];
        camera: SourcedCamera;
        times: TrackedTimes;
        networkFps: number;
        frame: ImageBitmap | null;
    });
    /** Keeps the frame when the next one is asked for: it is then closed by `close()` alone. */
    keep(): void;
    /**
     * One target in this frame, its first copy.
     *
     * @param {Target} target
     * @returns {TrackedTarget | undefined} undefined when it is not followed
     */
    of(target: Target): TrackedTarget | undefined;
    /**
     * All copies of a target's print in this frame, found or not, by number.
     *
     * @param {Target} target
     */
    copiesOf(target: Target): TrackedTarget[];
    /** Of the first target, for pages that follow one: whether it is found. */
    get found(): boolean;
    /** Of the first target: the whole surface; null unless found. */
    get mesh(): SurfaceMesh | null;
    /** Of the first target: correlation of image and visible print, 0 to 1. */
    get correlation(): number;
    /** Lets the frame go. */
    close(): void;
    /** Closes it at the end of the block of a `using` declaration. */
    [Symbol.dispose](): void;
}
