// Pictures and recordings of what is seen, on their way to the person.

import { DeepSftError } from "../error.js";

const FPS = 30;
const BITS_PER_SECOND = 8e6;
/** A recording ends by itself: it is kept in memory. */
const MAX_MS = 120_000;
/** Kinds of recordings, the one that most programs play first. */
const KINDS = ["video/mp4;codecs=avc1", "video/mp4", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
/** Pixels of the longer side of a picture or recording at most: what phones record fluently. */
const MAX_PIXELS = 1920;

/** What this browser records canvases as; undefined where it does not. */
export const recordingKind =
  typeof MediaRecorder === "undefined" || !("captureStream" in HTMLCanvasElement.prototype)
    ? undefined
    : KINDS.find((kind) => MediaRecorder.isTypeSupported(kind));

/**
 * A canvas for pictures and recordings of a part of the page. Both its sides are even, for video coders.
 *
 * @param {{ clientWidth: number, clientHeight: number }} area
 * @returns {HTMLCanvasElement}
 */
export function recordingCanvas({ clientWidth, clientHeight }) {
  const density = Math.min(devicePixelRatio, MAX_PIXELS / Math.max(clientWidth, clientHeight));
  const even = (/** @type {number} */ length) => 2 * Math.round((length * density) / 2);
  return Object.assign(document.createElement("canvas"), { width: even(clientWidth), height: even(clientHeight) });
}

/**
 * What a canvas shows, as a PNG. What WebGL has drawn is there only until the browser shows it: call it right after drawing.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {Promise<Blob>}
 * @throws {DeepSftError} `internal`
 */
export function pictureOf(canvas) {
  return new Promise((resolve, reject) =>
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new DeepSftError("internal", "The picture could not be written."))), "image/png"),
  );
}

/** A recording of a canvas that is under way. It ends by itself after two minutes. */
export class Recording {
  #recorder;
  #clock;
  /** Once it has ended. @type {Promise<Blob>} */
  finished;

  /**
   * @param {HTMLCanvasElement} canvas of even sides, whose size stays
   * @throws {DeepSftError} `browser-unsupported` where {@link recordingKind} is undefined
   */
  constructor(canvas) {
    if (recordingKind === undefined) throw new DeepSftError("browser-unsupported", "This browser does not record canvases.");
    const stream = canvas.captureStream(FPS);
    const recorder = new MediaRecorder(stream, { mimeType: recordingKind, videoBitsPerSecond: BITS_PER_SECOND });
    this.#recorder = recorder;
    /** @type {Blob[]} */
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    this.finished = new Promise((resolve, reject) => {
      const end = () => {
        clearTimeout(this.#clock);
        for (const track of stream.getTracks()) track.stop();
      };
      recorder.addEventListener("error", () => (end(), reject(new DeepSftError("internal", "The browser ended the recording."))));
      recorder.addEventListener("stop", () => (end(), resolve(new Blob(parts, { type: recorder.mimeType }))));
    });
    recorder.start(1000);
    this.#clock = setTimeout(() => this.stop(), MAX_MS);
  }

  /** Ends it. @returns {Promise<Blob>} what was recorded */
  stop() {
    if (this.#recorder.state !== "inactive") this.#recorder.stop();
    return this.finished;
  }
}

/**
 * Hands a file to the person: by the system's share sheet where browsers take files for it, else as a download.
 *
 * @param {Blob} blob
 * @param {string} name without its ending
 */
export async function shareFile(blob, name) {
  const [type] = blob.type.split(";");
  const file = new File([blob], `${name}.${type.split("/")[1]}`, { type });
  if (navigator.canShare?.({ files: [file] })) {
    // Who has changed their mind wants no download either.
    if (await navigator.share({ files: [file] }).then(() => true, ({ name }) => name === "AbortError")) return;
  }
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: file.name });
  link.click();
  // The download has begun by then.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
