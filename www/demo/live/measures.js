// The sheet in words that people understand: "Bent by 38°, 41 cm away".

import { measureSheet } from "deepsft";
import { part } from "../part.js";

/** @import { SourcedCamera, SurfaceMesh } from "deepsft" */
/** @typedef {{ distanceMm: number, bendDegrees: number }} Measures */
/** @typedef {{ bend: boolean, distance: boolean }} Told which of them are known */

/** The words change this often at most, and are read out this often, milliseconds. */
const STAND_MS = 250;
const READ_MS = 4000;
/** Time in which the measures follow the sheet most of the way, milliseconds. */
const CALM_MS = 300;
/** A sheet that bends less counts as flat: normals tremble by that. */
const FLAT_DEGREES = 8;
/** What has to change before it is read out again. */
const NEWS = { degrees: 12, fraction: 0.15 };

/**
 * @param {Measures} measures
 * @param {boolean} about whether the camera is only estimated
 * @param {Told} told
 */
export function measuresInWords({ distanceMm, bendDegrees }, about, told) {
  const bend = bendDegrees < FLAT_DEGREES ? "Flat" : `Bent by ${Math.round(bendDegrees)}°`;
  const distance = distanceMm < 995 ? `${Math.round(distanceMm / 10)} cm` : `${(distanceMm / 1000).toFixed(1)} m`;
  const words = [told.bend ? bend : "", told.distance ? `${about ? "about " : ""}${distance} away` : ""].filter(Boolean).join(", ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/**
 * Whether a person who was told `before` wants to know.
 *
 * @param {Measures | null} before
 * @param {Measures} now
 */
export function isNews(before, now) {
  if (!before) return true;
  const hasBent = Math.abs(now.bendDegrees - before.bendDegrees) >= NEWS.degrees;
  return hasBent || Math.abs(now.distanceMm / before.distanceMm - 1) >= NEWS.fraction;
}

export class MeasuresPanel {
  #words = part("#measures");
  /** For a screen reader. */
  #said = part("#measures-said");
  /** @type {Measures | null} */
  #mean = null;
  /** @type {Measures | null} */
  #read = null;
  #shownAt = -Infinity;
  #readAt = -Infinity;

  /**
   * @param {SurfaceMesh | null} mesh
   * @param {SourcedCamera} camera
   * @param {boolean} atOnce of a single image
   * @param {Told} told
   */
  show(mesh, camera, atOnce, told) {
    const now = performance.now();
    if (!mesh) return this.hide();
    if (!atOnce && now - this.#shownAt < STAND_MS) return;
    const seen = measureSheet(mesh);
    const weight = this.#mean && !atOnce ? 1 - Math.exp((this.#shownAt - now) / CALM_MS) : 1;
    const { distanceMm, bendDegrees } = this.#mean ?? seen;
    this.#mean = {
      distanceMm: distanceMm + weight * (seen.distanceMm - distanceMm),
      bendDegrees: bendDegrees + weight * (seen.bendDegrees - bendDegrees),
    };
    this.#shownAt = now;
    const words = measuresInWords(this.#mean, camera.source === "estimated", told);
    if (this.#words.textContent !== words) this.#words.textContent = words;
    this.#words.hidden = false;
    if (now - this.#readAt < READ_MS || !isNews(this.#read, this.#mean)) return;
    [this.#readAt, this.#read] = [now, this.#mean];
    this.#said.textContent = words;
  }

  /** Nothing is there to measure. */
  hide() {
    this.#words.hidden = true;
    this.#mean = null;
  }

  /** Forgets what was said. */
  reset() {
    this.hide();
    this.#said.textContent = "";
    [this.#read, this.#shownAt, this.#readAt] = [null, -Infinity, -Infinity];
  }
}
