// Frames of a video that lies in memory, for browsers whose processor draws: to them a frame is a drawing like any other, which takes
// four times as long as only converting its colours.

import { MAX_PIXELS } from "./image-input.js";

/** Canvases that take turns: one whose last picture is still used would first be copied. */
const CANVASES = 3;

/** Grabs the frames of a video by way of the same memory, which stays: fresh pages for each frame cost as much as the conversion. */
export class MemoryFrames {
  /** What frames are converted to. @type {ImageData | null} */
  #pixels = null;
  /** Of the canvases that they become pictures on. @type {OffscreenCanvasRenderingContext2D[]} */
  #contexts = [];
  #turn = 0;

  /**
   * The frame that a video shows.
   *
   * @param {HTMLVideoElement} video
   * @returns {Promise<{ frame: ImageBitmap, width: number, height: number } | null>} null where the browser has to draw it: it is turned,
   *   stretched, not in memory, or not there yet
   */
  async grab(video) {
    if (typeof VideoFrame === "undefined") return null;
    const { videoWidth: width, videoHeight: height } = video;
    let frame;
    try {
      frame = new VideoFrame(video);
      const { rotation = 0, flip = false } = /** @type {{ rotation?: number, flip?: boolean }} */ (frame);
      const { visibleRect } = frame;
      const asShown = visibleRect?.width === width && visibleRect.height === height && rotation === 0 && !flip;
      if (!asShown || frame.format === null || width * height > MAX_PIXELS) return null;
      if (this.#pixels?.width !== width || this.#pixels.height !== height) {
        this.#pixels = new ImageData(width, height);
        const canvases = Array.from({ length: CANVASES }, () => new OffscreenCanvas(width, height));
        this.#contexts = canvases.flatMap((canvas) => canvas.getContext("2d", { alpha: false, willReadFrequently: true }) ?? []);
      }
      const [pixels, context] = [this.#pixels, this.#contexts[this.#turn++ % CANVASES]];
      if (!context) throw new Error("This browser offers no canvas to put frames on.");
      const planes = await frame.copyTo(pixels.data, /** @type {VideoFrameCopyToOptions} */ ({ format: "RGBA" }));
      // Browsers that do not convert give the planes as they lie.
      if (planes.length !== 1 || planes[0].stride !== 4 * width || frame.format.startsWith("BGR")) return null;
      context.putImageData(pixels, 0, 0);
      return { frame: await createImageBitmap(context.canvas), width, height };
    } catch {
      // What is wrong with the frame, if anything is, drawing it will say.
      return null;
    } finally {
      frame?.close();
    }
  }
}
