// What can be printed on a sheet, as a texture: a picture, a canvas, a film.

import { CanvasTexture, SRGBColorSpace, Texture, VideoTexture } from "three";
import { unlessAborted } from "../abort.js";
import { isAddress } from "../address.js";
import { DeepSftError } from "../error.js";
import { drawsInSoftware } from "./drawing-speed.js";
import { closeFrame, readImage, transferableFrame } from "../frames/image-input.js";

/** @import { ImageInput } from "../frames/image-input.js" */

/**
 * An address or a file of a picture or film, an element that shows one, a canvas, whose newest picture is printed, or a texture of three.js.
 *
 * @typedef {ImageInput | Texture} PrintInput
 */

/**
 * A texture, whether it changes with each frame, and what lets go of it.
 *
 * @typedef {{ texture: Texture, film: HTMLVideoElement | null, isLive: boolean, close: () => void }} Print
 */

/** After so long without a picture a film is asked to play, milliseconds. */
const PATIENCE_MS = 4000;
const FILM = /\.(mp4|m4v|mov|webm|ogv)([?#]|$)/i;
/** Sharp also where the sheet is seen at a slant; dear where the processor draws. */
const ANISOTROPY = 8;

/**
 * @param {PrintInput} input
 * @param {HTMLElement} place where a film lies in the page: iPhones play no other
 * @param {AbortSignal} signal
 * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`
 */
export async function printOf(input, place, signal) {
  if (input instanceof Texture) return { texture: input, film: null, isLive: false, close: () => undefined };
  if (input instanceof HTMLVideoElement) return printed(new VideoTexture(input), { film: input });
  if (input instanceof HTMLCanvasElement || input instanceof OffscreenCanvas) return printed(new CanvasTexture(input), { isLive: true });
  if (isAddress(input) && FILM.test(String(input))) return openFilm(String(input), place, signal);
  const image = await readImage(input, signal);
  if (image instanceof Blob && image.type.startsWith("video/")) return openFilm(image, place, signal);
  const { frame } = await transferableFrame(image);
  const canvas = Object.assign(document.createElement("canvas"), { width: frame.width, height: frame.height });
  const context = canvas.getContext("2d");
  if (frame instanceof ImageData) context?.putImageData(frame, 0, 0);
  else context?.drawImage(frame, 0, 0);
  closeFrame(frame);
  return printed(new CanvasTexture(canvas));
}

/**
 * Plays a film until its first picture is there. Safari plays none of a server that sends no parts of files: what fails is fetched whole.
 *
 * @param {string | Blob} input
 * @param {HTMLElement} place
 * @param {AbortSignal} signal
 */
async function openFilm(input, place, signal) {
  let whole = input instanceof Blob ? URL.createObjectURL(input) : null;
  const film = document.createElement("video");
  Object.assign(film, { src: whole ?? input, crossOrigin: "anonymous", muted: true, loop: true, preload: "auto", tabIndex: -1 });
  film.playsInline = true;
  hide(film);
  place.append(film);
  const close = () => {
    film.remove();
    film.removeAttribute("src");
    film.load();
    if (whole) URL.revokeObjectURL(whole);
  };
  // iPhones fetch nothing before it is to play. Others are not asked to: WebKit on Linux may play on in secret what is paused as it begins.
  const begin = () => {
    if (film.readyState < HTMLMediaElement.HAVE_CURRENT_DATA) film.play().catch(() => undefined);
  };
  film.addEventListener("suspend", begin, { once: true });
  const waiting = setTimeout(begin, PATIENCE_MS);
  const fetchWhole = async () => {
    if (whole) throw film.error;
    const blob = /** @type {Blob} */ (await readImage(input, signal));
    if (!film.isConnected) return;
    film.src = whole = URL.createObjectURL(blob);
    film.load();
  };
  try {
    const first = new Promise((resolve, reject) => {
      film.addEventListener("loadeddata", resolve, { once: true });
      film.addEventListener("error", () => fetchWhole().catch(reject));
    });
    await unlessAborted(first, signal);
  } catch (cause) {
    close();
    signal.throwIfAborted();
    throw new DeepSftError("image-unreadable", `The film ${input} could not be played: it is not there, or of a kind this browser does not know.`, { cause });
  } finally {
    clearTimeout(waiting);
  }
  return printed(new VideoTexture(film), { film, close });
}

/**
 * @param {Texture} texture
 * @param {Partial<Print>} [print] what else is known of it
 * @returns {Print}
 */
function printed(texture, { film = null, isLive = false, close } = {}) {
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = drawsInSoftware() ? 1 : ANISOTROPY;
  return { texture, film, isLive, close: () => (texture.dispose(), close?.()) };
}

/** In the page, but not seen: iPhones play no video that is not displayed. @param {HTMLVideoElement} video */
export function hide(video) {
  video.setAttribute("aria-hidden", "true");
  Object.assign(video.style, { display: "block", position: "absolute", width: "1px", height: "1px", opacity: "0", pointerEvents: "none" });
}
