// Focal lengths that were calibrated in this browser, one for each camera and image size.

const PREFIX = "deepsft/focal/";

/**
 * A focal length and its standard deviation, pixels; null where nobody knows it.
 *
 * @typedef {{ focal: number, spread: number | null }} Calibration
 */

/** What was read or written since the page was opened; all there is where storage is blocked. @type {Map<string, Calibration | null>} */
const known = new Map();

/** @param {string} key */
export function readCalibration(key) {
  const kept = known.get(key);
  if (kept !== undefined) return kept;
  const text = inStorage((storage) => storage.getItem(PREFIX + key)) ?? "";
  const [focal, spread] = text.split(" ").map(Number);
  const isThere = Number.isFinite(focal) && focal > 0;
  const calibration = isThere ? { focal, spread: Number.isFinite(spread) && spread > 0 ? spread : null } : null;
  known.set(key, calibration);
  return calibration;
}

/**
 * Keeps a calibration unless a surer one is kept: both deviations are known, and that one's is the smaller part of its focal length.
 *
 * @param {string} key
 * @param {Calibration | null} calibration null forgets
 * @returns {boolean} whether it is what is kept now
 */
export function keepCalibration(key, calibration) {
  const [kept, spread] = [readCalibration(key), calibration?.spread ?? null];
  if (calibration && kept && kept.spread !== null && spread !== null && kept.spread / kept.focal < spread / calibration.focal) return false;
  known.set(key, calibration);
  inStorage((storage) => {
    if (calibration === null) storage.removeItem(PREFIX + key);
    else storage.setItem(PREFIX + key, [calibration.focal, calibration.spread ?? []].flat().join(" "));
  });
  return true;
}

/**
 * Does something with the browser's storage; where it is not there, full or forbidden, a calibration lasts as long as the page.
 *
 * @template T
 * @param {(storage: Storage) => T} action
 */
function inStorage(action) {
  try {
    return action(self.localStorage);
  } catch {
    return null;
  }
}
