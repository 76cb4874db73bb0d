// Synthetic clips with their truth, and what the native tracker says of them.

import { readFile, readdir } from "node:fs/promises";
import { join, relative, sep } from "node:path";

import { MODEL, made } from "./native.mjs";
import { readNpy } from "./npy.mjs";
import { sample } from "./pictures.mjs";
import { decodePng } from "./png.mjs";
import { untar } from "./tar.mjs";
import { WWW } from "../../serve.mjs";

/**
 * @typedef {object} ClipFrame
 * @property {Buffer} png
 * @property {string} address of the PNG on the development server: a page has it from there in a tenth of the time that it takes to hand it over
 * @property {{ width: number, height: number, rgb: Uint8Array }} picture
 * @property {Float32Array} vertices the true mesh, (x, y, z) each, camera frame, mm
 */

/**
 * A clip, 480 x 270 pixels times `scale`, or 270 x 480 `upright`, 30 frames a second: of the poster, of a picture that is printed
 * `widthMm` wide, or of a `template`, a folder.
 *
 * @param {{ event: string, frames: number, seed: number, scale?: number, upright?: boolean, picture?: string, widthMm?: number, template?: string }} options
 * @returns {Promise<{ folder: string, camera: object, frames: ClipFrame[] }>}
 */
export async function makeClip({ event, frames, seed, scale = 1, upright = false, picture, widthMm, template }) {
  const other = template ? ["--template", { input: template }] : ["--model", { input: MODEL }];
  const object = picture ? ["--picture", { input: picture }, "--size-mm", String(widthMm)] : other;
  const [count, size] = [String(frames), String(scale)];
  const folder = await made("clip", ...object, "--event", event, "--frames", count, "--scale", size, "--seed", String(seed), ...(upright ? ["--upright"] : []));
  const truth = new Map();
  for (const shard of (await readdir(join(folder, "truth"))).filter((name) => name.endsWith(".tar")).sort()) {
    for (const [name, content] of untar(await readFile(join(folder, "truth", shard)))) truth.set(name, content);
  }
  const records = [...truth.keys()].filter((name) => name.endsWith(".json")).sort();
  const images = (await readdir(folder)).filter((name) => name.endsWith(".png")).sort();
  if (records.length !== frames || images.length !== frames) throw new Error(`${folder} has not ${frames} frames`);
  const read = async (image, i) => {
    const path = join(folder, image);
    const png = await readFile(path);
    const { width, height, values } = decodePng(png);
    const { vertices_camera: vertices } = JSON.parse(truth.get(records[i]).toString("utf8"));
    return { png, address: `/${relative(WWW, path).replaceAll(sep, "/")}`, picture: { width, height, rgb: values }, vertices: Float32Array.from(vertices.flat()) };
  };
  const camera = JSON.parse(await readFile(join(folder, "camera.json"), "utf8"));
  return { folder, camera, frames: await Promise.all(images.map(read)) };
}

/**
 * Two clips of one camera as one, of a camera that sees what both show: each is turned about the camera's centre until its
 * middle is in the middle of its half. What it shows stays exact.
 *
 * @param {{ camera: object, frames: ClipFrame[] }} left
 * @param {{ camera: object, frames: ClipFrame[] }} right
 * @returns {{ picture: { width: number, height: number, rgb: Uint8Array }, vertices: [Float32Array, Float32Array] }[]} the
 *   meshes of left and right
 */
export function sideBySide(left, right) {
  const { width, height, fx, fy, cx, cy } = left.camera;
  const turn = Math.atan(width / 4 / fx);
  return left.frames.map(({ picture, vertices }, i) => {
    const rgb = new Uint8Array(3 * width * height);
    for (const [half, from, angle] of [[0, picture, turn], [1, right.frames[i].picture, -turn]]) {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      for (let row = 0; row < height; row++) {
        for (let column = (half * width) / 2; column < ((half + 1) * width) / 2; column++) {
          const [x, y] = [(column + 0.5 - cx) / fx, (row + 0.5 - cy) / fy];
          const depth = c - x * s;
          sample(from, (fx * (x * c + s)) / depth + cx - 0.5, (fy * y) / depth + cy - 0.5, rgb, 3 * (row * width + column));
        }
      }
    }
    return { picture: { width, height, rgb }, vertices: [turned(vertices, turn), turned(right.frames[i].vertices, -turn)] };
  });
}

/** Points in the frame of a camera that is turned about its vertical axis. */
function turned(points, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return points.map((value, i) => {
    if (i % 3 === 1) return value;
    const [x, z] = [points[i - (i % 3)], points[i - (i % 3) + 2]];
    return i % 3 === 0 ? x * c - z * s : x * s + z * c;
  });
}

/**
 * The native tracker on a clip, the network asked about the first frame and waited for.
 *
 * @param {{ folder: string, frames: ClipFrame[] }} clip
 * @returns {Promise<(Float32Array | null)[]>} the mesh in each frame, null where it is not found
 */
export async function nativeTrack(clip) {
  const count = clip.frames.length;
  const folder = await made("track", "--model", { input: MODEL }, "--find-every", String(count), { input: clip.folder });
  const { shape, values } = await readNpy(join(folder, "vertices.npy"));
  if (shape[0] !== count) throw new Error(`vertices.npy has ${shape[0]} frames of ${count}`);
  const length = shape[1] * shape[2];
  return Array.from({ length: count }, (_, i) => {
    const mesh = values.slice(i * length, (i + 1) * length);
    return Number.isNaN(mesh[0]) ? null : mesh;
  });
}
