// How fast a machine draws with WebGL.

import { SOFTWARE_NAMES } from "../engine/webgpu.js";

/** A machine that takes longer from frame to frame draws with its processor, which has better things to do. */
const SLOW_MS = 45;
/** It is judged by the median of this many draws, or of three when they take longer than a second together. */
const JUDGED_DRAWS = 12;

/** @type {boolean | null} */
let known = null;

/** Whether the browser says that the processor does the drawing, or offers no WebGL 2. Asked once. */
export function drawsInSoftware() {
  if (known !== null) return known;
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  known = !gl || SOFTWARE_NAMES.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return known;
}

/** Judges by the time from drawing to drawing: some browsers tell nobody that the processor draws (WebKit). */
export class Pace {
  #last = Number.NaN;
  /** @type {number[]} */
  #intervals = [];

  /**
   * Takes over a drawing that is due.
   *
   * @param {number} now milliseconds
   */
  isSlow(now) {
    const intervals = this.#intervals;
    if (Number.isFinite(this.#last)) intervals.push(now - this.#last);
    this.#last = now;
    const isEnough = intervals.length === JUDGED_DRAWS || (intervals.length >= 3 && intervals.reduce((sum, ms) => sum + ms, 0) > 1000);
    if (!isEnough) return false;
    const median = intervals.sort((a, b) => a - b)[intervals.length >> 1];
    this.#intervals = [];
    return median > SLOW_MS;
  }
}
