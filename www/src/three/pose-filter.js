// Poses that do not tremble.

import { Quaternion, Vector3 } from "three";

/** Cut-off for a pose at rest, Hz, and how it rises with speed, Hz per mm/s: as the tracker's `smooth`. */
const LEAST_CUTOFF_HZ = 2;
const PER_SPEED = 0.1;
/** Cut-off of the speeds themselves, Hz. */
const SPEED_CUTOFF_HZ = 1;
/** Turning counts as the motion of what is so far from the anchor, mm. */
const REACH_MM = 50;
/** After a longer pause the next pose is taken as it is, seconds. */
const LONGEST_PAUSE_S = 0.5;

/** The One-Euro filter (Casiez, Roussel and Vogel 2012) of a position and an orientation. */
export class PoseFilter {
  #atS = -Infinity;
  #position = new Vector3();
  #quaternion = new Quaternion();
  /** The last pose as it came. */
  #raw = { position: new Vector3(), quaternion: new Quaternion() };
  /** mm/s. */
  #velocity = new Vector3();
  #turning = 0;
  #step = new Vector3();

  /** Takes the next pose as it is. */
  reset() {
    this.#atS = -Infinity;
  }

  /**
   * @param {Vector3} position mm, replaced by the smooth one
   * @param {Quaternion} quaternion likewise
   * @param {number} atMs
   */
  apply(position, quaternion, atMs) {
    const dt = atMs / 1000 - this.#atS;
    this.#atS = atMs / 1000;
    const raw = this.#raw;
    if (!(dt <= LONGEST_PAUSE_S)) {
      this.#velocity.set(0, 0, 0);
      this.#turning = 0;
      this.#position.copy(position);
      this.#quaternion.copy(quaternion);
    } else if (dt > 0) {
      const speeds = weightOf(SPEED_CUTOFF_HZ, dt);
      this.#step.subVectors(position, raw.position).divideScalar(dt);
      this.#velocity.lerp(this.#step, speeds);
      this.#turning += speeds * ((raw.quaternion.angleTo(quaternion) * REACH_MM) / dt - this.#turning);
      this.#position.lerp(position, weightOf(LEAST_CUTOFF_HZ + PER_SPEED * this.#velocity.length(), dt));
      this.#quaternion.slerp(quaternion, weightOf(LEAST_CUTOFF_HZ + PER_SPEED * this.#turning, dt));
    }
    raw.position.copy(position);
    raw.quaternion.copy(quaternion);
    position.copy(this.#position);
    quaternion.copy(this.#quaternion);
  }
}

/**
 * Weight of a new value in a low-pass.
 *
 * @param {number} cutoffHz
 * @param {number} dt seconds
 */
function weightOf(cutoffHz, dt) {
  return 1 - Math.exp(-2 * Math.PI * cutoffHz * dt);
}
