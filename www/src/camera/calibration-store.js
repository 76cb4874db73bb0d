// Focal lengths that were calibrated in this browser, one for each camera and image size.

const PREFIX = "deepsft/focal/";

/**
 * A focal length and its standard deviation, pixels; null where nobody knows it.
 *
 * @typedef {{ focal: number, spread: number | null }} Calibration
 */

/**
 * What was read or written since the page was opened; all there is where storage is blocked.
 *
 * @type {Map<string, Calibration | null>}
 */
const known = new Map();

/** @param {(storage: Storage) => void} action left undone where there is no storage, it is full or forbidden */
function withStorage(action) {
  try {
    action(self.localStorage);
  } catch {
    // The calibration then lasts as long as the page.
  }
}

/** @param {string | null} text focal length and deviation, or the focal length alone, as earlier versions wrote it */
function parsed(text) {
  const [focal, spread] = (text ?? "").split(" ").map(Number);
  if (!(Number.isFinite(focal) && focal > 0)) return null;
  return { focal, spread: Number.isFinite(spread) && spread > 0 ? spread : null };
}

/** @param {string} key */
export function readCalibration(key) {
  if (!known.has(key)) {
    known.set(key, null);
    withStorage((storage) => known.set(key, parsed(storage.getItem(PREFIX + key))));
  }
  return known.get(key) ?? null;
}

/**
 * @param {string} key
 * @param {Calibration | null} calibration null forgets
 */
export function writeCalibration(key, calibration) {
  known.set(key, calibration);
  withStorage((storage) => {
    if (calibration === null) storage.removeItem(PREFIX + key);
    else storage.setItem(PREFIX + key, [calibration.focal, calibration.spread ?? []].flat().join(" "));
  });
}

/**
 * Whether one calibration is surer than another: both deviations are known, and its own is the smaller part of the focal length.
 *
 * @param {Calibration} one
 * @param {Calibration} other
 */
export function isSurer(one, other) {
  return one.spread !== null && other.spread !== null && one.spread / one.focal < other.spread / other.focal;
}
