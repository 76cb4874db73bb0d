// Two prints that nothing was trained for, moving side by side, and a third that is not shown.

import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";

import { makeClip, sideBySide } from "./clips.mjs";
import { encodePng } from "./png.mjs";
import { makePrint } from "./prints.mjs";

/** `seed` makes the picture, `clip` (one of the tests' own seeds) how it moves. The first two are shown. */
export const PRINTS = [
  { name: "left", widthMm: 150, width: 600, height: 400, seed: 11, clip: 9_700_025 },
  { name: "right", widthMm: 110, width: 420, height: 560, seed: 12, clip: 9_700_026 },
  { name: "absent", widthMm: 120, width: 500, height: 500, seed: 13 },
];

/** Twice the canonical image, as cameras have more pixels too. */
const SCALE = 2;

/**
 * @param {string} folder to work in
 * @param {number} frames
 * @returns {Promise<{ camera: object, shown: ReturnType<typeof sideBySide>, pngs: string[] }>} the pictures in Base64
 */
export async function twoPrints(folder, frames) {
  const clips = [];
  for (const { name, widthMm, width, height, seed, clip } of PRINTS) {
    const picture = join(folder, `${name}.png`);
    await writeFile(picture, encodePng(makePrint({ width, height, seed })));
    const options = { event: "motion", frames, seed: clip, scale: SCALE, picture, widthMm };
    if (clip) clips.push(await makeClip(options));
  }
  const [left, right] = clips;
  const pngs = await Promise.all(PRINTS.map(({ name }) => readFile(join(folder, `${name}.png`), "base64")));
  return { camera: left.camera, shown: sideBySide(left, right), pngs };
}

/** Frames there and back, so that nothing jumps where a film starts over; copies, to be changed. */
export function thereAndBack(shown) {
  const copy = ({ picture }) => ({ ...picture, rgb: Uint8Array.from(picture.rgb) });
  return [...shown.map(copy), ...shown.toReversed().map(copy)];
}
