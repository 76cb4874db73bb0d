// What the tracker says of one frame of a video.

/** @import { SourcedCamera, SurfaceMesh, Target } from "../index.js" */

/**
 * Milliseconds spent on a frame: `capture` (grabbing it and reading its pixels), `warp` (to the canonical image),
 * `track` (all targets), and `total`, from when the tracker was free for it to the result.
 *
 * @typedef {{ captureMs: number, warpMs: number, trackMs: number, totalMs: number }} TrackedTimes
 */

/** One target in one frame of a video. */
export class TrackedTarget {
  /** @param {{ target: Target, copy?: number, mesh: SurfaceMesh | null, held: boolean, correlation: number, iterations: number }} contents */
  constructor({ target, copy = 0, mesh, held, correlation, iterations }) {
    /** What is followed. */
    this.target = target;
    /** Which copy of its print, from 0; others than 0 where `addPicture` was asked for `copies`. A copy keeps its number while it is followed. */
    this.copy = copy;
    /**
     * Whether it is found: from when three frames in a row have confirmed its mesh, or one strongly, until none has for 0.4 s.
     */
    this.found = mesh !== null;
    /** The whole surface, hidden parts included; null unless found. */
    this.mesh = mesh;
    /** Whether this frame does not confirm the mesh: it stands where it was last confirmed, or about there. */
    this.held = held;
    /** Correlation of the normalised image with the normalised print over the visible sheet, 0 to 1. */
    this.correlation = correlation;
    /** Solver iterations this frame took. */
    this.iterations = iterations;
  }
}

/** One frame of a video with the meshes in it. */
export class TrackedFrame {
  /** @param {{ number: number, timeMs: number, targets: TrackedTarget[], camera: SourcedCamera, times: TrackedTimes, networkFps: number, frame: ImageBitmap | null }} contents */
  constructor({ number, timeMs, targets, camera, times, networkFps, frame }) {
    /** Counts the frames the tracker saw, from 1. */
    this.number = number;
    /** When it was shown, by the page's clock, or as it was given; milliseconds, ascending. */
    this.timeMs = timeMs;
    /** What each target is in this frame, in the order in which they were given, and their further copies after them. */
    this.targets = targets;
    /** The camera that was used, with its source. */
    this.camera = camera;
    /** Milliseconds spent on it. */
    this.times = times;
    /** Answers of the finders per second, by the time between the last two; 0 before. */
    this.networkFps = networkFps;
    /** The frame the meshes belong to: draw over this one, not over what the video shows by now. Closed by `close()`. */
    this.frame = frame;
    /** Whether it stays open when the next one is asked for. */
    this.kept = false;
  }

  /** Keeps the frame when the next one is asked for: it is then closed by `close()` alone. */
  keep() {
    this.kept = true;
  }

  /**
   * One target in this frame, its first copy.
   *
   * @param {Target} target
   * @returns {TrackedTarget | undefined} undefined when it is not followed
   */
  of(target) {
    return this.targets.find((tracked) => tracked.target === target);
  }

  /**
   * All copies of a target's print in this frame, found or not, by number.
   *
   * @param {Target} target
   */
  copiesOf(target) {
    return this.targets.filter((tracked) => tracked.target === target);
  }

  /** Of the first target, for pages that follow one: whether it is found. */
  get found() {
    return this.targets[0]?.found ?? false;
  }

  /** Of the first target: the whole surface; null unless found. */
  get mesh() {
    return this.targets[0]?.mesh ?? null;
  }

  /** Of the first target: correlation of image and visible print, 0 to 1. */
  get correlation() {
    return this.targets[0]?.correlation ?? 0;
  }

  /** Lets the frame go. */
  close() {
    this.frame?.close();
    this.frame = null;
  }

  /** Closes it at the end of the block of a `using` declaration. */
  [Symbol.dispose]() {
    this.close();
  }
}
