// What is drawn over a tracked sheet besides prints and objects: plaster, depth in colours, and the mesh itself.

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  DynamicDrawUsage,
  LineSegments,
  LinearFilter,
  MeshBasicMaterial,
  SRGBColorSpace,
  ShaderMaterial,
  Vector2,
  Vector3,
} from "three";
import { heatRow } from "../graphics/heat.js";

/** @import { SurfaceMesh, Target } from "deepsft" */
/** @import { Sheet } from "deepsft/three" */

const HEAT_COLOURS = 256;
/** A vertex whose standard deviation is more than this fraction of its depth is loose, as in the rule for a shape that is determined. */
const LOOSE = 0.01;

const SURFACE_VERTEX_SHADER = `
varying vec3 v_position;           // camera's frame
varying vec3 v_normal;
varying vec2 v_uv;
varying float v_depth;             // in the target's unit
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  v_position = seen.xyz;
  v_normal = normalMatrix * normal;
  v_uv = uv;
  v_depth = -position.z;
  gl_Position = projectionMatrix * seen;
}`;

const PLASTER_FRAGMENT_SHADER = `
uniform vec2 u_sheetMm;
varying vec3 v_position;
varying vec3 v_normal;
varying vec2 v_uv;
void main() {
  vec3 normal = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 key = normalize(vec3(-0.62, 0.62, 0.48));
  float diffuse = max(dot(normal, key), 0.0);
  float gloss = pow(max(dot(normal, normalize(key + normalize(-v_position))), 0.0), 60.0);
  vec3 base = gl_FrontFacing ? vec3(0.74, 0.71, 0.64) : vec3(0.62, 0.16, 0.085);
  // Steeper than a matt surface falls off, so that a gentle bend is seen.
  vec3 light = pow(diffuse, 1.6) * vec3(1.12, 1.04, 0.92) + 0.16 * max(dot(normal, normalize(vec3(0.8, -0.1, 0.6))), 0.0) * vec3(0.5, 0.75, 1.0)
    + (0.15 + 0.07 * normal.y) * vec3(0.58, 0.68, 0.78);
  // Squares of 15 mm, which show how it bends.
  vec2 mm = v_uv * u_sheetMm;
  vec2 slope = max(fwidth(mm), vec2(1e-4));
  vec2 line = abs(fract((mm - 0.5 * u_sheetMm) / 15.0 + 0.5) - 0.5) * 15.0 / slope;
  float grid = 1.0 - smoothstep(0.3, 1.3, min(line.x, line.y));
  base *= 1.0 - 0.34 * grid * smoothstep(4.0, 12.0, 15.0 / max(slope.x, slope.y));
  gl_FragColor = vec4(base * light + 0.07 * gloss, 1.0);
  #include <colorspace_fragment>
}`;

const DEPTH_FRAGMENT_SHADER = `
uniform sampler2D u_heat;
uniform vec3 u_scale;              // near, far, contour step, in the target's unit
varying float v_depth;
void main() {
  vec3 color = texture2D(u_heat, vec2((v_depth - u_scale.x) / (u_scale.y - u_scale.x), 0.5)).rgb;
  float level = v_depth / u_scale.z;
  float slope = max(fwidth(level), 1e-4);
  float line = 1.0 - smoothstep(0.5 * slope, 1.6 * slope, abs(fract(level + 0.5) - 0.5));
  float dense = 1.0 - smoothstep(0.1, 0.35, slope);
  float brightness = dot(color, vec3(0.21, 0.72, 0.07));
  gl_FragColor = vec4(mix(color, brightness > 0.1 ? vec3(0.01, 0.005, 0.02) : vec3(1.0), 0.4 * line * dense), 0.94);
  #include <colorspace_fragment>
}`;

const LINE_VERTEX_SHADER = `
attribute vec4 color;              // its last: how far it is seen
attribute vec2 sure;               // confidence, and 1 where the mesh is loose
varying vec3 v_sure;
void main() {
  v_sure = vec3(sure, color.a);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const LINE_FRAGMENT_SHADER = `
uniform vec3 u_sure;
uniform vec3 u_unsure;
varying vec3 v_sure;
void main() {
  // Lines are broken where the mesh is loose.
  if (v_sure.y > 0.5 && fract((gl_FragCoord.x + gl_FragCoord.y) / 10.0) > 0.5) discard;
  gl_FragColor = vec4(mix(u_unsure, u_sure, smoothstep(0.15, 0.6, v_sure.x)), mix(0.35, 0.9, smoothstep(0.3, 0.7, v_sure.z)));
  #include <colorspace_fragment>
}`;

/** @param {Target} target */
export function plasterMaterial({ widthMm, heightMm }) {
  const uniforms = { u_sheetMm: { value: new Vector2(widthMm, heightMm) } };
  return new ShaderMaterial({ vertexShader: SURFACE_VERTEX_SHADER, fragmentShader: PLASTER_FRAGMENT_SHADER, uniforms, side: DoubleSide, depthWrite: false });
}

/** Its uniform `u_scale` holds near, far and step of the contours. */
export function depthMaterial() {
  const heat = new DataTexture(heatRow(HEAT_COLOURS), HEAT_COLOURS, 1);
  Object.assign(heat, { colorSpace: SRGBColorSpace, magFilter: LinearFilter, needsUpdate: true });
  const uniforms = { u_heat: { value: heat }, u_scale: { value: new Vector3(0, 1, 1) } };
  const material = new ShaderMaterial({
    ...{ vertexShader: SURFACE_VERTEX_SHADER, fragmentShader: DEPTH_FRAGMENT_SHADER, uniforms },
    ...{ side: DoubleSide, transparent: true, depthWrite: false },
  });
  material.addEventListener("dispose", () => heat.dispose());
  return material;
}

/** A veil behind the lines, so that they are read on any print. */
export function veilMaterial() {
  return new MeshBasicMaterial({ color: 0x2f3f45, transparent: true, opacity: 0.42, side: DoubleSide, depthWrite: false });
}

/** The edges of a sheet's mesh, coloured by how sure it is; those that only halve a cell of a grid are left out. */
export class MeshLines extends LineSegments {
  #sure;

  /** @param {Sheet} sheet whose vertices it shares */
  constructor(sheet) {
    const geometry = new BufferGeometry();
    const { geometry: surface, target } = sheet;
    for (const name of ["position", "color"]) geometry.setAttribute(name, surface.getAttribute(name));
    const sure = new BufferAttribute(new Float32Array(2 * surface.getAttribute("position").count), 2).setUsage(DynamicDrawUsage);
    geometry.setAttribute("sure", sure);
    geometry.setIndex(edgesOf(target.mesh));
    const uniforms = { u_sure: { value: new Color(0x73ffd1) }, u_unsure: { value: new Color(0xff8f5c) } };
    super(geometry, new ShaderMaterial({ vertexShader: LINE_VERTEX_SHADER, fragmentShader: LINE_FRAGMENT_SHADER, uniforms, transparent: true, depthWrite: false }));
    this.frustumCulled = false;
    // It lies where the sheet lies.
    geometry.boundingBox = new Box3();
    this.#sure = sure;
  }

  /** @param {SurfaceMesh} mesh */
  follow({ confidence, deviations, vertices }) {
    for (let i = 0; i < confidence.length; i++) this.#sure.setXY(i, confidence[i], deviations[i] > LOOSE * vertices[3 * i + 2] ? 1 : 0);
    this.#sure.needsUpdate = true;
  }

  dispose() {
    // Those of the sheet live on.
    for (const name of ["position", "color"]) this.geometry.deleteAttribute(name);
    this.geometry.dispose();
    /** @type {ShaderMaterial} */ (this.material).dispose();
  }
}

/** @param {Target["mesh"]} mesh @returns {number[]} pairs of vertices */
function edgesOf({ faces, textureCoordinates: uv }) {
  const edges = new Map();
  for (let i = 0; i < faces.length; i++) {
    const [a, b] = [faces[i], faces[i - (i % 3) + ((i + 1) % 3)]].sort((x, y) => x - y);
    edges.set(a * uv.length + b, [a, b]);
  }
  const runs = (/** @type {number[]} */ [a, b], /** @type {number} */ axis) => Math.abs(uv[2 * a + axis] - uv[2 * b + axis]) > 1e-6;
  const all = [...edges.values()];
  const straight = all.filter((edge) => !(runs(edge, 0) && runs(edge, 1)));
  // Of a mesh that is no grid every edge is drawn.
  return (straight.length > all.length / 2 ? straight : all).flat();
}
