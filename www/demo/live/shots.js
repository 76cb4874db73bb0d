// Pictures and recordings of what is seen: the canvases of the stage as they lie on the page.

/** Pixels of the longer side at most: what phones record fluently. */
const MAX_PIXELS = 1920;
const RECORDING_FPS = 30;
const BITS_PER_SECOND = 8e6;
/** A recording ends by itself: it is kept in memory. */
const MAX_MS = 120_000;
/** Kinds of recordings, the one that most programs play first. */
const KINDS = ["video/mp4;codecs=avc1", "video/mp4", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

/** @typedef {{ area: HTMLElement, canvases: HTMLCanvasElement[] }} Scene the lowest canvas first */

/**
 * A canvas with the scene's shape. Both its sides are even, for video coders.
 *
 * @param {Scene} scene
 */
function canvasFor({ area: { clientWidth, clientHeight } }) {
  const density = Math.min(devicePixelRatio, MAX_PIXELS / Math.max(clientWidth, clientHeight));
  const even = (/** @type {number} */ length) => 2 * Math.round((length * density) / 2);
  return Object.assign(document.createElement("canvas"), { width: even(clientWidth), height: even(clientHeight) });
}

/**
 * Draws what is seen. What WebGL has drawn is there only until the browser shows it: call it right after drawing.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Scene} scene
 */
function drawScene(canvas, { area, canvases }) {
  const context = canvas.getContext("2d", { alpha: false });
  if (!context) throw new Error("This browser offers no canvas to draw a picture on.");
  const page = area.getBoundingClientRect();
  // The window may have turned since a recording began.
  const scale = Math.min(canvas.width / page.width, canvas.height / page.height);
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.translate((canvas.width - scale * page.width) / 2, (canvas.height - scale * page.height) / 2);
  context.scale(scale, scale);
  context.beginPath();
  context.rect(0, 0, page.width, page.height);
  context.clip();
  for (const drawn of canvases) {
    const box = drawn.getBoundingClientRect();
    if (box.width === 0 || drawn.width === 0) continue;
    const [x, y] = [box.left - page.left, box.top - page.top];
    const cover = getComputedStyle(drawn).objectFit === "cover" ? Math.max(box.width / drawn.width, box.height / drawn.height) : 0;
    const [width, height] = cover ? [cover * drawn.width, cover * drawn.height] : [box.width, box.height];
    context.drawImage(drawn, x + (box.width - width) / 2, y + (box.height - height) / 2, width, height);
  }
}

/**
 * @param {Scene} scene that has just been drawn
 * @returns {Promise<Blob>} PNG
 */
export function pictureOf(scene) {
  const canvas = canvasFor(scene);
  drawScene(canvas, scene);
  return new Promise((resolve, reject) =>
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("The picture could not be written."))), "image/png"),
  );
}

/** What this browser records as, if it records at all. @type {string | undefined} */
export const RECORDING_KIND =
  typeof MediaRecorder === "undefined" || !("captureStream" in HTMLCanvasElement.prototype)
    ? undefined
    : KINDS.find((kind) => MediaRecorder.isTypeSupported(kind));

/** A recording that is under way. */
export class Recording {
  #canvas;
  #recorder;
  #clock;
  /** @type {Promise<Blob>} once it has ended */
  finished;

  /** @param {Scene} scene */
  constructor(scene) {
    this.#canvas = canvasFor(scene);
    this.add(scene);
    const stream = this.#canvas.captureStream(RECORDING_FPS);
    const recorder = new MediaRecorder(stream, { mimeType: RECORDING_KIND, videoBitsPerSecond: BITS_PER_SECOND });
    this.#recorder = recorder;
    /** @type {Blob[]} */
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    this.finished = new Promise((resolve, reject) => {
      const end = () => {
        clearTimeout(this.#clock);
        for (const track of stream.getTracks()) track.stop();
      };
      recorder.addEventListener("error", () => (end(), reject(new Error("The browser ended the recording."))));
      recorder.addEventListener("stop", () => (end(), resolve(new Blob(parts, { type: recorder.mimeType }))));
    });
    recorder.start(1000);
    this.#clock = setTimeout(() => this.stop(), MAX_MS);
  }

  /** Adds what is seen now. @param {Scene} scene that has just been drawn */
  add(scene) {
    drawScene(this.#canvas, scene);
  }

  stop() {
    if (this.#recorder.state !== "inactive") this.#recorder.stop();
  }
}

/**
 * Hands a file to the person: by the system's share sheet where browsers take files for it, else as a download.
 *
 * @param {Blob} blob
 * @param {string} name without its ending
 */
export async function share(blob, name) {
  const [type] = blob.type.split(";");
  const file = new File([blob], `${name}.${type.split("/")[1]}`, { type });
  if (navigator.canShare?.({ files: [file] })) {
    try {
      return await navigator.share({ files: [file] });
    } catch (error) {
      // They changed their mind.
      if (error instanceof DOMException && error.name === "AbortError") return;
    }
  }
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: file.name });
  link.click();
  // The download has begun by then.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
