// Focal lengths that were calibrated in this browser, one for each camera and image size.

const PREFIX = "deepsft/focal/";

/**
 * What was read or written since the page was opened; all there is where storage is blocked.
 *
 * @type {Map<string, number | null>}
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

/**
 * @param {string} key
 * @returns {number | null} focal length, pixels
 */
export function readCalibration(key) {
  if (!known.has(key)) {
    known.set(key, null);
    withStorage((storage) => {
      const focal = Number(storage.getItem(PREFIX + key));
      if (Number.isFinite(focal) && focal > 0) known.set(key, focal);
    });
  }
  return known.get(key) ?? null;
}

/**
 * @param {string} key
 * @param {number | null} focal pixels; null forgets
 */
export function writeCalibration(key, focal) {
  known.set(key, focal);
  withStorage((storage) => {
    if (focal === null) storage.removeItem(PREFIX + key);
    else storage.setItem(PREFIX + key, String(focal));
  });
}
