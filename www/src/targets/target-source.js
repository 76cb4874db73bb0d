// From what a page gives as a target to what the workers take.

import { fileIn, folderOf, isAddress } from "../address.js";
import { fetchBytes, filesByName } from "../engine/bundle.js";
import { DeepSftError } from "../error.js";
import { closeFrame, opaquePixels, readImage, transferableFrame } from "../frames/image-input.js";

/** @import { ImageInput } from "../frames/image-input.js" */

/**
 * @typedef {object} PictureOptions
 * @property {number} [widthMm] width of the print, without the paper's margins; 5 to 20,000. Without it lengths are counted in that width,
 *   and the target's `unit` is `width`.
 * @property {number} [heightMm] its height; by the picture's sides when absent
 * @property {number} [aroundMm] diameter of the tin, bottle, mug or tube that the print goes around; it needs `widthMm`. A print longer
 *   than one turn covers its own end. When absent the print lies flat at rest.
 * @property {number} [copies] how many copies of the print `follow` follows at once, up to 16; each takes the finders about as long again.
 *   Default 1
 * @property {string} [name] for people; the file's own for a File and an address
 * @property {AbortSignal} [signal] rejects with its reason, and no target is added
 */

/**
 * What a worker makes a target of.
 *
 * @typedef {{ kind: "picture", pixels: ImageData, widthMm: number, heightMm: number, diameterMm: number | undefined, hasSize: boolean, copies: number }
 *   | { kind: "scan", files: Map<string, Uint8Array>, mmPerUnit: number } | { kind: "template", files: Map<string, Uint8Array> } | { kind: "model", files: Map<string, Uint8Array> }} TargetSource
 */

/**
 * The files of a template's folder: its address, the files by name, or the files as a file input gives them.
 *
 * @typedef {string | URL | Map<string, Uint8Array> | Iterable<File>} TemplateInput
 */

/** The engine looks at pictures with this many pixels along the longer side, or fewer: the canonical image has 480. */
const LONGEST_SIDE = 1024;

/** How far the ratio of the sides given may be from that of the picture, as a fraction: rounding, and a printer's margins. */
const MAX_STRETCH = 0.05;

/** The engine counts in millimetres: so wide is a print whose width is not known. */
const MADE_UP_MM = 200;

/** Copies of one print that may be followed. */
const MOST_COPIES = 16;

const TEMPLATE_FILE = "template.json";

/**
 * @param {string} name
 * @param {unknown} value
 * @returns {asserts value is number}
 */
function checkSide(name, value) {
  // Which lengths a print can have is the engine's to know.
  if (typeof value === "number" && value > 0 && value < Infinity) return;
  throw unusable(`${name} is ${value}, expected the length of the print in millimetres.`);
}

/**
 * @param {ImageInput} image
 * @param {PictureOptions} options
 * @returns {Promise<Extract<TargetSource, { kind: "picture" }>>}
 * @throws {DeepSftError} `target-unusable`, `image-unreadable`, `image-cross-origin`, `invalid-argument`
 */
export async function pictureSource(image, { widthMm: given, heightMm, aroundMm: diameterMm, copies = 1, signal }) {
  const hasSize = given !== undefined || heightMm !== undefined;
  const widthMm = hasSize ? given : MADE_UP_MM;
  checkSide("widthMm", widthMm);
  if (heightMm !== undefined) checkSide("heightMm", heightMm);
  if (diameterMm !== undefined && !hasSize)
    throw unusable(`aroundMm is ${diameterMm}, and widthMm is missing: the width of the print on the cylinder in millimetres.`);
  if (diameterMm !== undefined) checkSide("aroundMm", diameterMm);
  if (!(Number.isInteger(copies) && copies >= 1 && copies <= MOST_COPIES))
    throw new DeepSftError("invalid-argument", `copies is ${copies}, expected a whole number from 1 to ${MOST_COPIES}`);
  const { frame, width, height } = await transferableFrame(await readImage(image, signal));
  try {
    const naturalMm = (widthMm * height) / width;
    if (heightMm !== undefined && Math.abs(heightMm / naturalMm - 1) > MAX_STRETCH)
      throw unusable(
        `The picture has ${width} x ${height} pixels, which do not fit ${widthMm} x ${heightMm} mm: the size is that of the ` +
          "picture without the paper's margins.",
      );
    return { kind: "picture", pixels: await opaquePixels(frame, LONGEST_SIDE), widthMm, heightMm: heightMm ?? naturalMm, diameterMm, hasSize, copies };
  } finally {
    closeFrame(frame);
  }
}

/**
 * @param {TemplateInput} input
 * @returns {Promise<Extract<TargetSource, { kind: "template" | "model" }>>}
 * @throws {DeepSftError} `model-load`, `target-unusable`
 */
export async function templateSource(input) {
  if (!isAddress(input)) return { kind: "template", files: input instanceof Map ? input : await filesByName(input) };
  const folder = folderOf(input);
  const fetched = async (/** @type {string} */ name) => /** @type {const} */ ([name, await fetchBytes(fileIn(folder, encodeURIComponent(name)), undefined)]);
  const description = await fetched(TEMPLATE_FILE);
  let named;
  try {
    named = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(description[1]));
  } catch (error) {
    throw unusable(`${folder}${TEMPLATE_FILE} is not JSON; is this the folder of a template?`, error);
  }
  // What they must be is the engine's to check.
  const names = [named?.texture, named?.mesh].filter((name) => typeof name === "string");
  return { kind: "template", files: new Map([description, ...(await Promise.all(names.map(fetched)))]) };
}

/**
 * Whether two pictures have the same pixels.
 *
 * @param {TargetSource | undefined} one
 * @param {TargetSource} other
 */
export function isSamePicture(one, other) {
  if (one?.kind !== "picture" || other.kind !== "picture") return false;
  const [a, b] = [one.pixels, other.pixels];
  return a.width === b.width && a.height === b.height && a.data.every((value, i) => value === b.data[i]);
}

/**
 * @param {string} message
 * @param {unknown} [cause]
 */
export function unusable(message, cause) {
  return new DeepSftError("target-unusable", message, { cause });
}
