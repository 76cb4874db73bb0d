// The sheet by itself, from the side: what the mesh knows beyond the picture.

import { createProgram, createTexture, webGlOf } from "./gl.js";
import { PAPERS_GLSL } from "./papers.js";
import { prefersStillness } from "./animation.js";

/** @import { MeshTopology, SurfaceMesh, Target } from "deepsft" */

const VERTEX_SHADER = `#version 300 es
precision highp float;
layout(location = 0) in vec3 a_position;   // camera frame, mm
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec2 a_uv;
uniform vec3 u_centre;             // that the view turns about, camera frame, mm
uniform float u_size;              // mm from the centre to the view's edge
uniform mat3 u_turn;
uniform float u_aspect;
out vec3 v_normal;
out vec3 v_toEye;
out vec2 v_uv;
void main() {
  vec3 p = u_turn * (a_position - u_centre) / u_size;
  // The eye is 3.2 sizes away: a mild perspective.
  vec3 seen = p + vec3(0.0, 0.0, 3.2);
  v_normal = u_turn * a_normal;
  v_toEye = -seen;
  v_uv = a_uv;
  gl_Position = vec4(3.2 * seen.x / u_aspect, -3.2 * seen.y, 0.5 * (seen.z - 3.2) * seen.z, seen.z);
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D u_print;
in vec3 v_normal;
in vec3 v_toEye;
in vec2 v_uv;
out vec4 o_color;
${PAPERS_GLSL}
void main() {
  vec3 normal = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 key = normalize(vec3(-0.55, -0.7, -0.6));
  float diffuse = max(dot(normal, key), 0.0);
  float gloss = pow(max(dot(normal, normalize(key + normalize(v_toEye))), 0.0), 30.0);
  vec3 base = gl_FrontFacing ? linearFromDisplay(texture(u_print, v_uv).rgb) : vec3(0.72, 0.69, 0.62);
  o_color = vec4(displayFromLinear(base * (0.28 + 0.95 * diffuse) + 0.07 * gloss), 1.0);
}`;

/** Farthest the view turns by itself to either side, radians, and the seconds of a turn there and back. */
const SWAY = 0.62;
const SWAY_SECONDS = 9;
const MAX_PITCH = 1.35;
/** Radians a CSS pixel of dragging. */
const DRAG = 0.011;
/** Yaw and pitch, radians, of the arrow keys. @type {Readonly<Record<string, [number, number]>>} */
const KEYS = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] };
/** Seconds in which the view follows the sheet most of the way: it stands, the sheet moves. */
const FOLLOW_SECONDS = 0.6;

export class Orbit {
  #canvas;
  #gl;
  #program;
  #print;
  #vertices;
  #coordinates;
  #faces;
  #count = 0;
  #size = 1;
  /** @type {[number, number, number] | null} */
  #centre = null;
  #shownAt = 0;
  #yaw = 0;
  #pitch = 0.22;
  /** Whether someone has turned the view: then it stays as they left it. */
  #held = false;
  #listening = new AbortController();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {boolean} software whether the processor does the drawing, for which smooth edges are dear
   * @throws {NoWebGl}
   */
  constructor(canvas, software) {
    const gl = webGlOf(canvas, { alpha: true, antialias: !software });
    this.#canvas = canvas;
    this.#gl = gl;
    this.#program = createProgram(gl, VERTEX_SHADER, FRAGMENT_SHADER);
    this.#print = createTexture(gl, gl.LINEAR_MIPMAP_LINEAR);
    this.#vertices = gl.createBuffer();
    this.#coordinates = gl.createBuffer();
    this.#faces = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#vertices);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 24, 12 * location);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#coordinates);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(2, 2, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#faces);
    gl.enable(gl.DEPTH_TEST);
    this.#listen();
  }

  /** @param {Pick<Target, "texture" | "widthMm" | "heightMm"> & { mesh: MeshTopology }} template */
  setTemplate({ texture, widthMm, heightMm, mesh: { faces, textureCoordinates } }) {
    const gl = this.#gl;
    gl.bindTexture(gl.TEXTURE_2D, this.#print);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, texture);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#coordinates);
    gl.bufferData(gl.ARRAY_BUFFER, textureCoordinates, gl.STATIC_DRAW);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    this.#count = faces.length;
    this.#size = 0.54 * Math.hypot(widthMm, heightMm);
  }

  /** Forgets where the sheet was, and how the view was turned. */
  reset() {
    this.#centre = null;
    [this.#yaw, this.#pitch, this.#held] = [0, 0.22, false];
  }

  /**
   * Draws a mesh, if the view is on the page.
   *
   * @param {Pick<SurfaceMesh, "vertices" | "normals">} mesh
   */
  show({ vertices, normals }) {
    if (this.#canvas.clientWidth === 0) return;
    const gl = this.#gl;
    const count = vertices.length / 3;
    const filled = new Float32Array(6 * count);
    const mean = [0, 0, 0];
    for (let i = 0; i < count; i++) {
      for (let k = 0; k < 3; k++) {
        filled[6 * i + k] = vertices[3 * i + k];
        filled[6 * i + 3 + k] = normals[3 * i + k];
        mean[k] += vertices[3 * i + k] / count;
      }
    }
    const last = this.#centre ?? mean;
    const now = performance.now() / 1000;
    const pace = 1 - Math.exp((this.#shownAt - now) / FOLLOW_SECONDS);
    this.#shownAt = now;
    const follow = (/** @type {number} */ k) => last[k] + pace * (mean[k] - last[k]);
    this.#centre = [follow(0), follow(1), follow(2)];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#vertices);
    gl.bufferData(gl.ARRAY_BUFFER, filled, gl.DYNAMIC_DRAW);
    this.#draw();
  }

  /** Turns no more: another view draws on the canvas. */
  stop() {
    this.#listening.abort();
  }

  #draw() {
    const [gl, canvas] = [this.#gl, this.#canvas];
    if (!this.#centre) return;
    const density = Math.min(2, devicePixelRatio);
    const [width, height] = [Math.round(canvas.clientWidth * density), Math.round(canvas.clientHeight * density)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { program, uniform } = this.#program;
    const phase = prefersStillness() ? 0.25 : performance.now() / 1000 / SWAY_SECONDS;
    const yaw = this.#held ? this.#yaw : SWAY * Math.sin(2 * Math.PI * phase);
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(this.#pitch), Math.sin(this.#pitch)];
    gl.useProgram(program);
    gl.bindTexture(gl.TEXTURE_2D, this.#print);
    gl.uniform1i(uniform("u_print"), 0);
    gl.uniform3f(uniform("u_centre"), ...this.#centre);
    // All of it is seen in a narrow view too.
    gl.uniform1f(uniform("u_size"), this.#size * Math.max(1, height / width));
    gl.uniform1f(uniform("u_aspect"), width / height);
    // Yaw about the camera's y axis, then pitch about its x axis; column by column.
    gl.uniformMatrix3fv(uniform("u_turn"), false, [cy, sp * sy, -cp * sy, 0, cp, sp, sy, -sp * cy, cp * cy]);
    gl.drawElements(gl.TRIANGLES, this.#count, gl.UNSIGNED_INT, 0);
  }

  /**
   * @param {number} yaw radians
   * @param {number} pitch radians
   */
  #turn(yaw, pitch) {
    if (!this.#held) this.#yaw = 0;
    this.#held = true;
    this.#yaw += yaw;
    this.#pitch = Math.min(MAX_PITCH, Math.max(-MAX_PITCH, this.#pitch + pitch));
    this.#draw();
  }

  #listen() {
    const canvas = this.#canvas;
    const { signal } = this.#listening;
    // Positions rather than `movementX`, whose unit differs between browsers and screens.
    let [x, y] = [0, 0];
    /** @type {(event: PointerEvent) => void} */
    const hold = ({ pointerId, clientX, clientY }) => {
      canvas.setPointerCapture(pointerId);
      [x, y] = [clientX, clientY];
      this.#turn(0, 0);
    };
    /** @type {(event: PointerEvent) => void} */
    const drag = ({ pointerId, clientX, clientY }) => {
      if (!canvas.hasPointerCapture(pointerId)) return;
      const [right, down] = [clientX - x, clientY - y];
      [x, y] = [clientX, clientY];
      this.#turn(DRAG * right, -DRAG * down);
    };
    /** @type {(event: KeyboardEvent) => void} */
    const press = (event) => {
      const turn = KEYS[event.key];
      if (!turn) return;
      event.preventDefault();
      this.#turn(...turn);
    };
    canvas.addEventListener("pointerdown", hold, { signal });
    canvas.addEventListener("pointermove", drag, { signal });
    canvas.addEventListener("keydown", press, { signal });
  }
}
