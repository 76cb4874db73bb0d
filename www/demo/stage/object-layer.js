// A thing on the sheet: where it stands, in the light of the sheet, with its shadow.

import { SurfacePose } from "deepsft";
import { SheetLight } from "deepsft/light";
import { createProgram } from "../graphics/gl.js";
import { prefersStillness } from "../graphics/animation.js";
import { MAX_HEIGHT, OBJECTS } from "../objects/objects.js";
import { STRIDE } from "../objects/solids.js";
import { OBJECT_FRAGMENT_SHADER, OBJECT_VERTEX_SHADER, SHADOW_MAP_FRAGMENT_SHADER, SHADOW_MAP_VERTEX_SHADER } from "./object-shader.js";
import { setProjection } from "./projection.js";

/** @import { SourcedCamera, SurfaceMesh, Target } from "deepsft" */
/** @import { VertexLight } from "deepsft/light" */
/** @import { Program } from "../graphics/gl.js" */
/** @import { ObjectName } from "../objects/objects.js" */
/** @import { MeshView } from "./mesh-layer.js" */

/** The radius of the circle it stands in, of the sheet's shorter side. */
export const SCALE = 0.27;
/** Pixels a side of its picture from the light; half as many where the processor draws. */
const SHADOW_LENGTH = 512;
/** Least time between two looks at the light on the sheet, milliseconds: reading pixels back has a GPU wait. */
const LIGHT_MS = 120;
/** Radians and seconds of the waves. */
const SWAY = 0.09;
const SWAY_SECONDS = 3.4;
/** A place nearer to the border would have it stand half in the air, of the sheet's sides. */
const BORDER = 0.1;

export class ObjectLayer {
  #gl;
  #software;
  #program;
  #shadowProgram;
  /** @type {Map<ObjectName, { array: WebGLVertexArrayObject, count: number }>} */
  #solids = new Map();
  #shadowMap;
  #framebuffer;
  #shadowLength;
  #light = new SheetLight();
  #lightAt = -Infinity;
  /** @type {{ target: Target, vertexLight: VertexLight, pose: SurfacePose } | null} */
  #sheet = null;
  /** @type {{ mesh: SurfaceMesh, seen: Float32Array } | null} */
  #newest = null;
  #scaleMm = 1;
  /** Middle of the sheet, where it stands first. @type {[number, number]} */
  #place = [0.5, 0.5];
  #sway = 0;
  /** @type {ObjectName} */
  name = "house";

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {boolean} software whether the processor does the drawing
   */
  constructor(gl, software) {
    this.#gl = gl;
    this.#software = software;
    this.#shadowLength = software ? SHADOW_LENGTH / 2 : SHADOW_LENGTH;
    /** @type {(() => Program)} each made when it is first drawn with */
    this.#program = once(() => createProgram(gl, OBJECT_VERTEX_SHADER, OBJECT_FRAGMENT_SHADER));
    this.#shadowProgram = once(() => createProgram(gl, SHADOW_MAP_VERTEX_SHADER, SHADOW_MAP_FRAGMENT_SHADER));
    this.#shadowMap = gl.createTexture();
    this.#framebuffer = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, this.#shadowMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT16, this.#shadowLength, this.#shadowLength);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.LINEAR);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, axis, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
  }

  /** Whether it moves by itself. */
  get moves() {
    return this.name === "boat" && !this.#software && !prefersStillness();
  }

  /**
   * @param {Target} target
   * @param {VertexLight} vertexLight on its vertices
   */
  setTemplate(target, vertexLight) {
    this.#place = [0.5, 0.5];
    this.#scaleMm = SCALE * Math.min(target.widthMm, target.heightMm);
    this.#sheet = { target, vertexLight, pose: new SurfacePose(target.mesh, ...this.#place) };
    this.#light.reset();
    this.#newest = null;
  }

  /** Where it stands, (u, v). */
  get place() {
    return this.#place;
  }

  /** @param {[number, number]} place */
  set place([u, v]) {
    const within = (/** @type {number} */ at) => Math.min(1 - BORDER, Math.max(BORDER, at));
    this.#place = [within(u), within(v)];
    this.#sheet?.pose.place(...this.#place);
    if (this.#newest) this.follow(this.#newest.mesh, this.#newest.seen, performance.now());
  }

  /**
   * Takes over a mesh.
   *
   * @param {SurfaceMesh | null} mesh null when nothing is followed
   * @param {Float32Array} seen
   * @param {number} atMs
   */
  follow(mesh, seen, atMs) {
    this.#newest = mesh && { mesh, seen };
    if (mesh) this.#sheet?.pose.follow(mesh, atMs);
    else this.#sheet?.pose.lose();
  }

  /** Corners of the box around it, camera frame, mm. @returns {Float32Array} */
  get bounds() {
    const [turn, origin] = [this.#turn(), this.#sheet?.pose.position ?? [0, 0, 0]];
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1 ? 1 : -1, i & 2 ? MAX_HEIGHT : 0, i & 4 ? 1 : -1]);
    return Float32Array.from(corners.flatMap((p) => [0, 1, 2].map((k) => origin[k] + this.#scaleMm * (turn[k] * p[0] + turn[3 + k] * p[1] + turn[6 + k] * p[2]))));
  }

  /**
   * Looks at the light on the sheet now and then, and draws its own shadow as the light sees it.
   *
   * @param {SourcedCamera} camera
   * @param {() => ImageData} smallFrame the camera's image, small
   * @param {number} seconds for what sways
   */
  prepare(camera, smallFrame, seconds) {
    const now = performance.now();
    if (this.#newest && this.#sheet && now - this.#lightAt > LIGHT_MS) {
      const { mesh, seen } = this.#newest;
      this.#light.follow(this.#sheet.vertexLight.of(mesh.vertices, seen, camera, smallFrame()), mesh.normals, seen, now);
      this.#lightAt = now;
    }
    this.#sway = this.moves ? SWAY * Math.sin((2 * Math.PI * seconds) / SWAY_SECONDS) : 0;
    const gl = this.#gl;
    const { program, uniform } = this.#shadowProgram();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.#shadowMap, 0);
    gl.viewport(0, 0, this.#shadowLength, this.#shadowLength);
    gl.disable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniform("u_lightFromCamera"), false, this.#lightFromCamera());
    this.#drawSolid(uniform);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /**
   * Gives a shader of the sheet what its shadow needs.
   *
   * @param {Program["uniform"]} uniform
   */
  castShadow(uniform) {
    const gl = this.#gl;
    const { everywhere, directed } = this.#light.light;
    const turn = this.#turn();
    const onSheet = Math.max(0, directed[0] * turn[3] + directed[1] * turn[4] + directed[2] * turn[5]);
    this.#bindShadow(uniform);
    gl.uniform3f(uniform("u_origin"), ...(this.#sheet?.pose.position ?? [0, 0, 0]));
    gl.uniform1f(uniform("u_scaleMm"), this.#scaleMm);
    gl.uniform1f(uniform("u_shade"), everywhere / Math.max(1e-3, everywhere + onSheet));
  }

  /**
   * Draws it over what is on the canvas, behind what hides it.
   *
   * @param {MeshView} view
   */
  draw({ camera, view, canvasSize, strength, tint }) {
    const gl = this.#gl;
    const { program, uniform } = this.#program();
    const { everywhere, directed } = this.#light.light;
    const turn = this.#turn();
    gl.useProgram(program);
    setProjection(gl, uniform, camera, [view.left, view.top, view.scale], canvasSize);
    this.#bindShadow(uniform);
    gl.uniform3f(uniform("u_tint"), ...tint);
    gl.uniform1f(uniform("u_everywhere"), everywhere);
    gl.uniform1f(uniform("u_directed"), Math.hypot(...directed));
    gl.uniform3f(uniform("u_up"), turn[3], turn[4], turn[5]);
    gl.uniform1f(uniform("u_strength"), strength);
    gl.enable(gl.DEPTH_TEST);
    this.#drawSolid(uniform);
    gl.disable(gl.DEPTH_TEST);
  }

  /** @param {Program["uniform"]} uniform */
  #bindShadow(uniform) {
    const gl = this.#gl;
    const { directed } = this.#light.light;
    const length = Math.hypot(...directed);
    // Behind the textures of the mesh's shaders.
    const unit = 7;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.#shadowMap);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(uniform("u_shadow"), unit);
    gl.uniformMatrix4fv(uniform("u_lightFromCamera"), false, this.#lightFromCamera());
    gl.uniform3f(uniform("u_toLight"), directed[0] / length, directed[1] / length, directed[2] / length);
    gl.uniform1f(uniform("u_shadowTexel"), (2 * this.#reach()) / this.#shadowLength);
  }

  /** Radius of a ball around it, mm. */
  #reach() {
    return this.#scaleMm * Math.hypot(1, MAX_HEIGHT / 2);
  }

  /** From the camera's frame to the cube that the light sees: column by column. */
  #lightFromCamera() {
    const { directed } = this.#light.light;
    const length = Math.hypot(...directed);
    const [x, y, z] = directed.map((value) => value / length);
    const turn = this.#turn();
    const origin = this.#sheet?.pose.position ?? [0, 0, 0];
    const centre = [0, 1, 2].map((k) => origin[k] + (turn[3 + k] * this.#scaleMm * MAX_HEIGHT) / 2);
    // Two directions across the light.
    const [ax, ay, az] = Math.abs(x) < 0.7 ? cross([x, y, z], [1, 0, 0]) : cross([x, y, z], [0, 1, 0]);
    const across = Math.hypot(ax, ay, az);
    const a = [ax / across, ay / across, az / across];
    const b = cross([x, y, z], a);
    const reach = this.#reach();
    // What the shadow falls on lies farther from the light: depth reaches as far again.
    const rows = [a.map((v) => v / reach), b.map((v) => v / reach), [x, y, z].map((v) => -v / (2 * reach))];
    const offsets = rows.map((row) => -(row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2]));
    return new Float32Array([
      ...[rows[0][0], rows[1][0], rows[2][0], 0],
      ...[rows[0][1], rows[1][1], rows[2][1], 0],
      ...[rows[0][2], rows[1][2], rows[2][2], 0],
      ...[offsets[0], offsets[1], offsets[2], 1],
    ]);
  }

  /** From its own frame to the camera's: column by column. */
  #turn() {
    const [x, y, z, w] = this.#sheet?.pose.quaternion ?? [0, 0, 0, 1];
    return [
      ...[1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
      ...[2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
      ...[2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
    ];
  }

  /** @param {Program["uniform"]} uniform */
  #drawSolid(uniform) {
    const gl = this.#gl;
    gl.uniformMatrix3fv(uniform("u_turn"), false, this.#turn());
    gl.uniform3f(uniform("u_origin"), ...(this.#sheet?.pose.position ?? [0, 0, 0]));
    gl.uniform1f(uniform("u_scaleMm"), this.#scaleMm);
    gl.uniform1f(uniform("u_sway"), this.#sway);
    const { array, count } = this.#solid();
    gl.bindVertexArray(array);
    gl.drawArrays(gl.TRIANGLES, 0, count);
    gl.bindVertexArray(null);
  }

  #solid() {
    const gl = this.#gl;
    const known = this.#solids.get(this.name);
    if (known) return known;
    const corners = OBJECTS[this.name]();
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    for (const [location, size, offset] of [
      [0, 3, 0],
      [1, 3, 3],
      [2, 4, 6],
    ]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 4 * STRIDE, 4 * offset);
    }
    gl.bindVertexArray(null);
    const solid = { array, count: corners.length / STRIDE };
    this.#solids.set(this.name, solid);
    return solid;
  }
}

/** @param {number[]} a @param {number[]} b */
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/**
 * @template T
 * @param {() => T} make
 * @returns {() => T}
 */
function once(make) {
  /** @type {T | undefined} */
  let made;
  return () => (made ??= make());
}
