// The sheet on the start screen: a bending A4 page, drawn to show what the page is about.

import { animate, prefersStillness } from "./animation.js";
import { createProgram, createTexture, drawsInSoftware } from "./gl.js";
import { PAPERS_GLSL } from "./papers.js";

const COLUMNS = 56;
const ROWS = 40;
/** The sheet is drawn in a box of this size, mm: the poster fills it. */
const BOX_MM = [297, 210];
/** The texture of the poster, 768 pixels wide: as an ornament the whole of it, 1.8 MB, would be too much. */
const POSTER_URL = "demo/hero.webp";
/** Seconds in which the poster appears once it is there. */
const APPEAR_SECONDS = 0.6;
/** The moment that shows it well, for those who want no motion. */
const STILL_SECONDS = 5.2;

const VERTEX_SHADER = `#version 300 es
precision highp float;
const float DISTANCE = 520.0;  // from the eye to the sheet, mm
uniform vec2 u_size;      // canvas, pixels
uniform float u_seconds;
uniform vec2 u_sheetMm;
in vec2 a_uv;
out vec2 v_mm;
out vec3 v_normal;

/* A developable bend: arc length s along the rulings' normal becomes an arc of varying curvature. */
vec3 bent(vec2 mm) {
  vec2 p = mm - 0.5 * u_sheetMm;
  float turn = 0.5 * sin(u_seconds * 0.23);
  vec2 across = vec2(cos(turn), sin(turn));
  float s = dot(p, across);
  float along = dot(p, vec2(-across.y, across.x));
  float curvature = 0.0055 * sin(u_seconds * 0.61);
  float second = 0.0000022 * sin(u_seconds * 0.43 + 1.0);
  /* Integrates the direction angle k s + c s^3 by eight trapezoids. */
  vec2 q = vec2(0.0);
  float h = s / 8.0;
  for (int i = 0; i < 8; i++) {
    float m = (float(i) + 0.5) * h;
    float angle = curvature * m + second * m * m * m * 0.1;
    q += h * vec2(cos(angle), sin(angle));
  }
  vec2 plane = q.x * across + along * vec2(-across.y, across.x);
  return vec3(plane, q.y);
}

vec3 posed(vec3 p) {
  float yaw = 0.42 * sin(u_seconds * 0.31 + 0.6);
  float pitch = 0.34 + 0.16 * sin(u_seconds * 0.27);
  mat3 about_y = mat3(cos(yaw), 0, -sin(yaw), 0, 1, 0, sin(yaw), 0, cos(yaw));
  mat3 about_x = mat3(1, 0, 0, 0, cos(pitch), sin(pitch), 0, -sin(pitch), cos(pitch));
  return about_x * (about_y * p);
}

vec2 projected(vec3 p) {
  return p.xy * (DISTANCE / (p.z + DISTANCE));
}

/* Centre of what is seen of the sheet, so that it stays in the middle however it turns. */
vec2 centre() {
  vec2 low = vec2(1e6);
  vec2 high = vec2(-1e6);
  for (int j = 0; j <= 2; j++) {
    for (int i = 0; i <= 2; i++) {
      vec2 p = projected(posed(bent(0.5 * vec2(i, j) * u_sheetMm)));
      low = min(low, p);
      high = max(high, p);
    }
  }
  return 0.5 * (low + high);
}

void main() {
  vec2 mm = a_uv * u_sheetMm;
  vec3 p = posed(bent(mm));
  vec3 dx = posed(bent(mm + vec2(2, 0))) - p;
  vec3 dy = posed(bent(mm + vec2(0, 2))) - p;
  v_normal = normalize(cross(dx, dy));
  v_mm = mm;
  float focal = 2.0 * min(u_size.x / 318.0, u_size.y / 250.0);
  vec2 ndc = (projected(p) - centre()) * vec2(1, -1) * focal / u_size;
  float w = (p.z + DISTANCE) / DISTANCE;
  gl_Position = vec4(ndc * w, (w - 1.0) * 0.8, w);
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
precision highp int;
uniform float u_seconds;
uniform vec2 u_sheetMm;
uniform sampler2D u_print;
uniform float u_printShown;  // 0 to 1
in vec2 v_mm;
in vec3 v_normal;
out vec4 o_color;
${PAPERS_GLSL}
const float FIRST_SEAM = 0.45;
const float SECOND_SEAM = 0.78;

void main() {
  float pixelMm = max(fwidth(v_mm.x), fwidth(v_mm.y));
  vec3 normal = gl_FrontFacing ? v_normal : -v_normal;
  vec3 light = normalize(vec3(-0.45, -0.75, 0.75));
  float shade = 0.42 + 0.62 * max(0.0, dot(normalize(v_normal), light));
  vec3 color;
  if (gl_FrontFacing) {
    /* Three bands that wander: the picture as it is printed turns into one paper, and that into the next. */
    float line = v_mm.x / u_sheetMm.x + 0.16 * (v_mm.y / u_sheetMm.y - 0.5) + 0.05 * sin(u_seconds * 0.4 + v_mm.y * 0.03);
    float stroke = pixelMm / u_sheetMm.x;
    vec3 poster = linearFromDisplay(texture(u_print, v_mm / u_sheetMm).rgb);
    poster = mix(vec3(0.86, 0.84, 0.8), poster, u_printShown);
    vec3 aurora = auroraPaper(v_mm, pixelMm, u_sheetMm, u_seconds);
    vec3 squares = squaresPaper(v_mm, pixelMm, u_sheetMm, u_seconds);
    color = mix(poster, aurora, smoothstep(-stroke, stroke, line - FIRST_SEAM));
    color = mix(color, squares, smoothstep(-stroke, stroke, line - SECOND_SEAM));
    float seam = min(abs(line - FIRST_SEAM), abs(line - SECOND_SEAM));
    color = mix(vec3(0.92), color, smoothstep(0.0022, 0.0022 + stroke, seam));
    vec2 inset = min(v_mm, u_sheetMm - v_mm);
    color = mix(vec3(0.9, 0.88, 0.84), color, smoothstep(6.0, 6.0 + pixelMm, min(inset.x, inset.y)));
  } else {
    color = vec3(0.86, 0.84, 0.8);
  }
  o_color = vec4(displayFromLinear(color * shade), 1.0);
}`;

export class Hero {
  #canvas;
  /** @type {{ gl: WebGL2RenderingContext, program: ReturnType<typeof createProgram>, indices: number, software: boolean } | null} */
  #sheet = null;
  /** @type {() => void} */
  #stop = () => undefined;
  /** Whether it is drawn only when something changes. */
  #still = false;
  /** Whether drawing turned out slow: some browsers tell nobody that the processor draws (WebKit). */
  #slow = false;
  #printSince = Infinity;
  /** @type {[number, number]} */
  #sheetMm = [BOX_MM[0], BOX_MM[1]];
  /** @type {WebGLTexture | null} */
  #print = null;
  /** The person's own print, if there is one. @type {HTMLCanvasElement | null} */
  #own = null;

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.#canvas = canvas;
    canvas.addEventListener("webglcontextlost", (event) => {
      // Without this the context would not come back.
      event.preventDefault();
      this.#sheet = this.#print = null;
    });
    canvas.addEventListener("webglcontextrestored", () => this.#build());
    this.#build();
  }

  /** Makes what is drawn, for the first time or anew in a context that was given back. */
  #build() {
    const gl = this.#canvas.getContext("webgl2", { alpha: true, antialias: true, depth: true });
    // An ornament: without WebGL the start screen does without.
    if (!gl) return;
    const program = createProgram(gl, VERTEX_SHADER, FRAGMENT_SHADER);
    const [uv, indices] = [[], []].map((list) => /** @type {number[]} */ (list));
    for (let j = 0; j <= ROWS; j++) for (let i = 0; i <= COLUMNS; i++) uv.push(i / COLUMNS, j / ROWS);
    for (let j = 0; j < ROWS; j++) {
      for (let i = 0; i < COLUMNS; i++) {
        const a = j * (COLUMNS + 1) + i;
        indices.push(a, a + COLUMNS + 1, a + 1, a + 1, a + COLUMNS + 1, a + COLUMNS + 2);
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(uv), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
    const location = gl.getAttribLocation(program.program, "a_uv");
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, 2, gl.FLOAT, false, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    this.#sheet = { gl, program, indices: indices.length, software: drawsInSoftware(gl) };
    if (this.#own) this.#show(this.#own);
    else void this.#loadPoster(gl);
  }

  /** Whether the processor does the drawing, as it does without WebGL. */
  get software() {
    return this.#slow || (this.#sheet?.software ?? true);
  }

  /**
   * Shows the person's own print, or the poster again.
   *
   * @param {{ canvas: HTMLCanvasElement, widthMm: number, heightMm: number } | null} picture
   */
  setPicture(picture) {
    if (!this.#sheet) return;
    this.#own = picture?.canvas ?? null;
    const [width, height] = picture ? [picture.widthMm, picture.heightMm] : BOX_MM;
    // As large as the box allows, upright ones a little beyond it: there is room above and below.
    const scale = Math.min(BOX_MM[0] / width, (1.15 * BOX_MM[1]) / height, Math.sqrt((BOX_MM[0] * BOX_MM[1]) / (width * height)));
    this.#sheetMm = [width * scale, height * scale];
    if (picture) this.#show(picture.canvas);
    else void this.#loadPoster(this.#sheet.gl);
  }

  /** @param {WebGL2RenderingContext} gl */
  async #loadPoster(gl) {
    const response = await fetch(POSTER_URL).catch(() => null);
    // Without it the sheet stays blank there; loading the model will say what is wrong.
    if (!response?.ok) return;
    const poster = await createImageBitmap(await response.blob());
    if (!gl.isContextLost() && !this.#own) this.#show(poster);
    poster.close();
  }

  /** @param {ImageBitmap | HTMLCanvasElement} print */
  #show(print) {
    if (!this.#sheet) return;
    const { gl } = this.#sheet;
    this.#print ??= createTexture(gl, gl.LINEAR_MIPMAP_LINEAR);
    gl.bindTexture(gl.TEXTURE_2D, this.#print);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, print);
    gl.generateMipmap(gl.TEXTURE_2D);
    this.#printSince = performance.now() - (this.#still ? 1000 * APPEAR_SECONDS : 0);
    if (this.#still) requestAnimationFrame(() => this.#draw(STILL_SECONDS));
  }

  start() {
    this.stop();
    this.#setStill(this.software || prefersStillness());
    if (this.#still) {
      requestAnimationFrame(() => this.#draw(STILL_SECONDS));
      return;
    }
    const draw = (/** @type {number} */ seconds) => {
      this.#draw(STILL_SECONDS + seconds);
      return true;
    };
    this.#stop = animate(draw, () => {
      this.#slow = true;
      this.#setStill(true);
    });
  }

  /** @param {boolean} still */
  #setStill(still) {
    this.#still = still;
    this.#canvas.dataset.still = String(still);
  }

  stop() {
    this.#stop();
  }

  /** @param {number} seconds */
  #draw(seconds) {
    if (!this.#sheet) return;
    const { gl, program, indices } = this.#sheet;
    const canvas = this.#canvas;
    const density = Math.min(2, devicePixelRatio);
    const [width, height] = [Math.round(canvas.clientWidth * density), Math.round(canvas.clientHeight * density)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program.program);
    gl.uniform2f(program.uniform("u_size"), width, height);
    gl.uniform1f(program.uniform("u_seconds"), seconds);
    gl.uniform2f(program.uniform("u_sheetMm"), ...this.#sheetMm);
    gl.uniform1f(
      program.uniform("u_printShown"),
      Math.min(1, Math.max(0, (performance.now() - this.#printSince) / 1000 / APPEAR_SECONDS)),
    );
    gl.drawElements(gl.TRIANGLES, indices, gl.UNSIGNED_SHORT, 0);
  }
}
