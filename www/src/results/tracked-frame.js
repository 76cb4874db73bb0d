// What the tracker says of one frame of a video.

/** @import { SourcedCamera } from "../camera/intrinsics.js" */
/** @import { SurfaceMesh } from "./surface-mesh.js" */

/**
 * Milliseconds spent on a frame: `capture` (grabbing it and reading its pixels), `warp` (to the canonical image),
 * `track`, and `total`, from when the tracker was free for it to the result.
 *
 * @typedef {{ captureMs: number, warpMs: number, trackMs: number, totalMs: number }} TrackedTimes
 */

/** One frame of a video with the mesh in it. */
export class TrackedFrame {
  /**
   * @param {object} contents
   * @param {number} contents.number
   * @param {SurfaceMesh | null} contents.mesh
   * @param {number} contents.agreement
   * @param {number} contents.iterations
   * @param {SourcedCamera} contents.camera
   * @param {TrackedTimes} contents.times
   * @param {number} contents.networkFps
   * @param {ImageBitmap | null} contents.frame
   */
  constructor({ number, mesh, agreement, iterations, camera, times, networkFps, frame }) {
    /** Counts the frames the tracker saw, from 1. */
    this.number = number;
    /** Whether the template is being followed. */
    this.found = mesh !== null;
    /** The whole surface, hidden parts included; null unless found. */
    this.mesh = mesh;
    /** Fraction of the visible print that the image confirms, 0 to 1. */
    this.agreement = agreement;
    /** Solver iterations this frame took. */
    this.iterations = iterations;
    /** The camera that was used, with its source. */
    this.camera = camera;
    this.times = times;
    /** Answers of the network per second, by the time between the last two; 0 before. */
    this.networkFps = networkFps;
    /** The frame the mesh belongs to: draw over this one, not over what the video shows by now. Closed by `close()`. */
    this.frame = frame;
  }

  /** Lets the frame go. */
  close() {
    this.frame?.close();
    this.frame = null;
  }
}
