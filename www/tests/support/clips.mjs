// Synthetic clips with their truth, and what the native tracker says of them.

import { readFile, readdir } from "node:fs/promises";
import { join } from "node:path";

import { MODEL, deepsft } from "./native.mjs";
import { readNpy } from "./npy.mjs";
import { decodePng } from "./png.mjs";
import { untar } from "./tar.mjs";

/**
 * @typedef {object} ClipFrame
 * @property {Buffer} png
 * @property {{ width: number, height: number, rgb: Uint8Array }} picture
 * @property {Float32Array} vertices the true mesh, (x, y, z) each, camera frame, mm
 */

/**
 * A clip of the poster, 480 x 270 pixels, 30 frames a second.
 *
 * @param {string} folder to write
 * @param {{ event: string, frames: number, seed: number }} options
 * @returns {Promise<{ folder: string, camera: object, frames: ClipFrame[] }>}
 */
export async function makeClip(folder, { event, frames, seed }) {
  await deepsft(
    "clip",
    ...["--model", MODEL, "--event", event, "--frames", String(frames), "--seed", String(seed), "--out", folder],
  );
  const truth = new Map();
  for (const shard of (await readdir(join(folder, "truth"))).filter((name) => name.endsWith(".tar")).sort()) {
    for (const [name, content] of untar(await readFile(join(folder, "truth", shard)))) truth.set(name, content);
  }
  const records = [...truth.keys()].filter((name) => name.endsWith(".json")).sort();
  const images = (await readdir(folder)).filter((name) => name.endsWith(".png")).sort();
  if (records.length !== frames || images.length !== frames) throw new Error(`${folder} has not ${frames} frames`);
  const read = async (image, i) => {
    const png = await readFile(join(folder, image));
    const { width, height, values } = decodePng(png);
    const { vertices_camera: vertices } = JSON.parse(truth.get(records[i]).toString("utf8"));
    return { png, picture: { width, height, rgb: values }, vertices: Float32Array.from(vertices.flat()) };
  };
  const camera = JSON.parse(await readFile(join(folder, "camera.json"), "utf8"));
  return { folder, camera, frames: await Promise.all(images.map(read)) };
}

/**
 * The native tracker on a clip, the network asked about the first frame and waited for.
 *
 * @param {string} folder to write
 * @param {{ folder: string, frames: ClipFrame[] }} clip
 * @returns {Promise<(Float32Array | null)[]>} the mesh in each frame, null where it is not found
 */
export async function nativeTrack(folder, clip) {
  const count = clip.frames.length;
  await deepsft(
    "track",
    ...["--model", MODEL, "--network-every", String(count), "--out", folder, clip.folder],
  );
  const { shape, values } = await readNpy(join(folder, "vertices.npy"));
  if (shape[0] !== count) throw new Error(`vertices.npy has ${shape[0]} frames of ${count}`);
  const length = shape[1] * shape[2];
  return Array.from({ length: count }, (_, i) => {
    const mesh = values.slice(i * length, (i + 1) * length);
    return Number.isNaN(mesh[0]) ? null : mesh;
  });
}
