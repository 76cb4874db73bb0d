// A video's camera as a camera of three.js.

import { MathUtils, PerspectiveCamera } from "three";

/** @import { Camera } from "../camera/intrinsics.js" */

/**
 * How an image fills a canvas of another shape, as CSS says it: `cover` cuts what juts out, `contain` shows all of it. The image lies
 * centred.
 *
 * @typedef {"cover" | "contain"} FrameFit
 */

/**
 * Sees what a video's camera sees, in millimetres: at the origin, looking along -z with y up, like any camera of three.js.
 *
 * A canvas pixel and the image point below it are one ray, also where image and canvas differ in shape. The lens' distortion is no part
 * of it: {@link FrameBackground} takes it out of the image.
 */
export class FrameCamera extends PerspectiveCamera {
  /** @type {Camera | null} of the newest frame */
  intrinsics = null;
  /** What of the image the canvas shows, pixels; it reaches beyond the image where `contain` leaves borders. */
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
    const { width, height, fx, fy, cy } = intrinsics;
    const [perWidth, perHeight] = [canvas.width / width, canvas.height / height];
    const scale = this.fit === "cover" ? Math.max(perWidth, perHeight) : Math.min(perWidth, perHeight);
    const [halfWidth, halfHeight] = [canvas.width / scale / 2, canvas.height / scale / 2];
    this.intrinsics = intrinsics;
    this.region = {
      left: width / 2 - halfWidth,
      top: height / 2 - halfHeight,
      right: width / 2 + halfWidth,
      bottom: height / 2 + halfHeight,
    };
    this.aspect = ((this.region.right - this.region.left) * fy) / ((this.region.bottom - this.region.top) * fx);
    const { top, bottom } = this.region;
    this.fov = MathUtils.radToDeg(Math.atan((cy - top) / fy) + Math.atan((bottom - cy) / fy));
    this.updateProjectionMatrix();
  }

  /** @override */
  updateProjectionMatrix() {
    // The constructor of PerspectiveCamera calls it too.
    if (!this.intrinsics) return super.updateProjectionMatrix();
    const { fx, fy, cx, cy } = this.intrinsics;
    const { left, top, right, bottom } = this.region;
    const { near, far } = this;
    const [perX, perY] = [near / fx, near / fy];
    this.projectionMatrix.makePerspective(
      ...[(left - cx) * perX, (right - cx) * perX, (cy - top) * perY, (cy - bottom) * perY],
      ...[near, far, this.coordinateSystem, this.reversedDepth],
    );
    this.projectionMatrixInverse.copy(this.projectionMatrix).invert();
  }
}
