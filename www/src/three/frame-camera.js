// A video's camera as a camera of three.js.

import { MathUtils, PerspectiveCamera } from "three";

/** @import { Camera } from "../camera/intrinsics.js" */

/**
 * How an image fills a canvas of another shape, as CSS says it: `cover` cuts what juts out, `contain` shows all of it. A number covers the
 * canvas as far as the image is then at most so many times as large as `contain` has it. The image lies centred.
 *
 * @typedef {"cover" | "contain" | number} FrameFit
 */

/** A part of an image, pixels. @typedef {{ left: number, top: number, right: number, bottom: number }} Region */

/**
 * Sees what a video's camera sees, in millimetres: at the origin, looking along -z with y up, like any camera of three.js.
 *
 * A canvas pixel and the image point below it are one ray, also where image and canvas differ in shape. The lens' distortion is no part
 * of it: {@link FrameBackground} takes it out of the image.
 */
export class FrameCamera extends PerspectiveCamera {
  /** @type {Camera | null} of the newest frame */
  intrinsics = null;
  /** What of the image the canvas shows; it reaches beyond the image where `contain` leaves borders. @type {Region} */
  region = { left: 0, top: 0, right: 1, bottom: 1 };

  /** @param {{ near?: number, far?: number, fit?: FrameFit }} [options] near and far in mm, default 20 and 10,000; fit default `cover` */
  constructor({ near = 20, far = 10_000, fit = "cover" } = {}) {
    super(50, 1, near, far);
    /** @type {FrameFit} */
    this.fit = fit;
  }

  /**
   * Takes over a frame's camera and the canvas's shape; cheap enough for each frame.
   *
   * @param {Camera} intrinsics `tracked.camera`
   * @param {{ width: number, height: number }} canvas its size in any unit: the element, or a Vector2 from `renderer.getSize`
   */
  setIntrinsics(intrinsics, canvas) {
    const { width, height } = intrinsics;
    const [perWidth, perHeight] = [canvas.width / width, canvas.height / height];
    const most = this.fit === "cover" ? Infinity : this.fit === "contain" ? 1 : this.fit;
    const scale = Math.min(Math.max(perWidth, perHeight), most * Math.min(perWidth, perHeight));
    const [halfWidth, halfHeight] = [canvas.width / scale / 2, canvas.height / scale / 2];
    this.intrinsics = intrinsics;
    this.lookAtRegion({ left: width / 2 - halfWidth, top: height / 2 - halfHeight, right: width / 2 + halfWidth, bottom: height / 2 + halfHeight });
  }

  /**
   * Sees a part of the image alone, which the canvas then shows, until the next {@link setIntrinsics}.
   *
   * @param {Region} region
   */
  lookAtRegion(region) {
    const { fx, fy, cx, cy } = this.intrinsics ?? { fx: 1, fy: 1, cx: 0, cy: 0 };
    const { left, top, right, bottom } = (this.region = region);
    // In focal lengths: a view of that size around the axis, shifted to where the region is.
    const [width, height] = [(right - left) / fx, (bottom - top) / fy];
    this.fov = MathUtils.radToDeg(2 * Math.atan(height / 2));
    this.setViewOffset(width, height, (left - cx) / fx + width / 2, (top - cy) / fy + height / 2, width, height);
  }
}
