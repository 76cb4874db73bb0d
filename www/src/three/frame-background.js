// The camera's image behind everything else in a scene.

import { BufferAttribute, BufferGeometry, LinearFilter, Mesh, ShaderMaterial, SRGBColorSpace, Texture, Vector2, Vector4 } from "three";
import { LENS_GLSL, lensUniform } from "../camera/lens.js";
import { FrameCamera } from "./frame-camera.js";

/** Before all that a page orders by itself. */
const FIRST = -1e6;

const VERTEX_SHADER = `
uniform vec4 u_region;             // left, top, right, bottom, image pixels
varying vec2 v_pixel;
void main() {
  v_pixel = mix(u_region.xw, u_region.zy, 0.5 + 0.5 * position.xy);
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;

const FRAGMENT_SHADER = `
uniform sampler2D u_frame;         // its first row at v = 0
uniform vec4 u_camera;             // fx, fy, cx, cy, pixels
uniform vec2 u_size;               // pixels
varying vec2 v_pixel;
${LENS_GLSL}
void main() {
  vec2 uv = (distorted((v_pixel - u_camera.zw) / u_camera.xy) * u_camera.xy + u_camera.zw) / u_size;
  if (any(greaterThan(abs(uv - 0.5), vec2(0.5)))) discard;
  gl_FragColor = vec4(texture2D(u_frame, uv).rgb, 1.0);
  #include <colorspace_fragment>
}`;

/**
 * A frame of the video, where the {@link FrameCamera} that renders the scene sees it. Content lies on it exactly because it is the frame
 * that was tracked, not what the video shows by now. Of a lens that distorts it shows what a pinhole would see.
 *
 * For `WebGLRenderer`. Elsewhere lay the canvas over the video element, with `object-fit: cover`.
 */
export class FrameBackground extends Mesh {
  #texture;
  #uniforms;
  /** @type {{ close?: () => void } | null} */
  #shown = null;
  #warned = false;

  constructor() {
    const geometry = new BufferGeometry();
    // One triangle that covers the canvas.
    geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const texture = new Texture();
    const uniforms = {
      u_frame: { value: texture },
      u_camera: { value: new Vector4(1, 1, 0, 0) },
      u_lens: { value: lensUniform({}) },
      u_region: { value: new Vector4() },
      u_size: { value: new Vector2(1, 1) },
    };
    const shaders = { vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER };
    super(geometry, new ShaderMaterial({ ...shaders, uniforms, depthTest: false, depthWrite: false, toneMapped: false }));
    this.#uniforms = uniforms;
    this.#texture = texture;
    this.name = "frame";
    this.renderOrder = FIRST;
    this.frustumCulled = false;
    this.visible = false;
    texture.colorSpace = SRGBColorSpace;
    texture.minFilter = LinearFilter;
    texture.generateMipmaps = false;
    // Bitmaps are uploaded as they are, so all else is too.
    texture.flipY = false;
    this.onBeforeRender = (/** @type {unknown[]} */ ...[, , camera]) => this.#lookThrough(camera);
  }

  /**
   * Shows a frame from the next rendering on.
   *
   * @param {{ frame: ImageBitmap | HTMLVideoElement | null, keep?: () => void, close?: () => void }} tracked a `TrackedFrame` or an
   *   `Estimate`, kept, and closed when the next one is shown. A video may be given in its place: `{ frame: video }`.
   */
  show(tracked) {
    const { frame } = tracked;
    if (!frame || tracked === this.#shown) return;
    tracked.keep?.();
    const [width, height] = "videoWidth" in frame ? [frame.videoWidth, frame.videoHeight] : [frame.width, frame.height];
    const size = this.#uniforms.u_size.value;
    if (size.x !== width || size.y !== height) this.#texture.dispose();
    size.set(width, height);
    this.#texture.image = frame;
    this.#texture.needsUpdate = true;
    this.visible = true;
    this.#shown?.close?.();
    this.#shown = tracked;
  }

  /** Lets frame, texture and material go. */
  dispose() {
    this.#shown?.close?.();
    [this.#shown, this.visible] = [null, false];
    this.#texture.dispose();
    this.geometry.dispose();
    /** @type {ShaderMaterial} */ (this.material).dispose();
  }

  /** Not a thing that rays hit. @override */
  raycast() {}

  /** @param {unknown} camera */
  #lookThrough(camera) {
    const isOurs = camera instanceof FrameCamera;
    if (!isOurs && !this.#warned) console.warn("FrameBackground is seen through a FrameCamera alone: other cameras do not know where the image lies.");
    this.#warned ||= !isOurs;
    const { u_camera, u_lens, u_region, u_size } = this.#uniforms;
    /** @type {ShaderMaterial} */ (this.material).uniformsNeedUpdate = true;
    // A place beyond the image, which draws nothing.
    if (!isOurs || !camera.intrinsics) return void u_region.value.setScalar(-1e6);
    const { intrinsics, region } = camera;
    // Those of the picture at another scale are scaled.
    const [sx, sy] = [u_size.value.x / intrinsics.width, u_size.value.y / intrinsics.height];
    u_camera.value.set(intrinsics.fx * sx, intrinsics.fy * sy, intrinsics.cx * sx, intrinsics.cy * sy);
    u_region.value.set(region.left * sx, region.top * sy, region.right * sx, region.bottom * sy);
    u_lens.value = lensUniform(intrinsics);
  }
}
