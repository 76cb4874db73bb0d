// Poses that do not tremble.

/** Cut-off for a pose at rest, Hz, and how it rises with speed, Hz per mm/s: as the tracker's `smooth`. */
const MIN_CUTOFF_HZ = 2;
const PER_SPEED = 0.1;
/** Cut-off of the speeds themselves, Hz. */
const SPEED_CUTOFF_HZ = 1;
/** Turning counts as the motion of what is so far from the anchor, mm. */
const REACH_MM = 50;
/** After a longer pause the next pose is taken as it is, seconds. */
const LONGEST_PAUSE_S = 0.5;

/** @typedef {[number, number, number]} Position mm */
/** @typedef {[number, number, number, number]} Quaternion (x, y, z, w), of length 1 */

/** The One-Euro filter (Casiez, Roussel and Vogel 2012) of a position and an orientation. */
export class PoseFilter {
  #atS = -Infinity;
  /** @type {Position} */
  #position = [0, 0, 0];
  /** @type {Quaternion} */
  #quaternion = [0, 0, 0, 1];
  /** The last pose as it came. @type {{ position: Position, quaternion: Quaternion }} */
  #raw = { position: [0, 0, 0], quaternion: [0, 0, 0, 1] };
  /** mm/s. @type {Position} */
  #velocity = [0, 0, 0];
  #turning = 0;
  #perMm;

  /** @param {number} [perMm] a millimetre in the unit of the positions */
  constructor(perMm = 1) {
    this.#perMm = perMm;
  }

  /** Takes the next pose as it is. */
  reset() {
    this.#atS = -Infinity;
  }

  /**
   * @param {Position} position replaced by the smooth one
   * @param {Quaternion} quaternion likewise
   * @param {number} atMs
   */
  apply(position, quaternion, atMs) {
    const dt = atMs / 1000 - this.#atS;
    this.#atS = atMs / 1000;
    const raw = this.#raw;
    if (!(dt <= LONGEST_PAUSE_S)) {
      [this.#velocity, this.#turning] = [[0, 0, 0], 0];
      [this.#position, this.#quaternion] = [[...position], [...quaternion]];
    } else if (dt > 0) {
      const speeds = weightOf(SPEED_CUTOFF_HZ, dt);
      for (let k = 0; k < 3; k++) this.#velocity[k] += speeds * ((position[k] - raw.position[k]) / dt - this.#velocity[k]);
      const angle = 2 * Math.acos(Math.min(1, Math.abs(dot(raw.quaternion, quaternion))));
      this.#turning += speeds * ((angle * REACH_MM) / dt - this.#turning);
      const moved = weightOf(MIN_CUTOFF_HZ + (PER_SPEED * Math.hypot(...this.#velocity)) / this.#perMm, dt);
      for (let k = 0; k < 3; k++) this.#position[k] += moved * (position[k] - this.#position[k]);
      slerp(this.#quaternion, quaternion, weightOf(MIN_CUTOFF_HZ + PER_SPEED * this.#turning, dt));
    }
    this.#raw = { position: [...position], quaternion: [...quaternion] };
    Object.assign(position, this.#position);
    Object.assign(quaternion, this.#quaternion);
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

/** @param {Quaternion} a @param {Quaternion} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];

/**
 * Turns one orientation towards another, the shorter way.
 *
 * @param {Quaternion} from changed
 * @param {Quaternion} to
 * @param {number} weight 0 to 1
 */
function slerp(from, to, weight) {
  const cosine = dot(from, to);
  const angle = Math.acos(Math.min(1, Math.abs(cosine)));
  const sine = Math.sin(angle);
  // Nearly the same: the arc is its chord.
  const [a, b] = sine < 1e-6 ? [1 - weight, weight] : [Math.sin((1 - weight) * angle) / sine, Math.sin(weight * angle) / sine];
  const sign = cosine < 0 ? -b : b;
  for (let k = 0; k < 4; k++) from[k] = a * from[k] + sign * to[k];
  const length = Math.hypot(...from);
  for (let k = 0; k < 4; k++) from[k] /= length;
}
