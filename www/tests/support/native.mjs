// The native program, as the browser's judge: it makes frames nobody has seen, with their truth, and estimates the
// same pictures.

import { execFile } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync } from "node:fs";
import { mkdir, mkdtemp, readFile, readdir, rename, rm, stat, utimes, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { promisify } from "node:util";

import { glbPositions } from "./glb.mjs";
import { readNpy } from "./npy.mjs";
import { decodePng } from "./png.mjs";
import { ROOT, WWW } from "../../serve.mjs";
import { untar } from "./tar.mjs";

const CLI = process.env.DEEPSFT_CLI ?? join(ROOT, "target", "release", "deepsft");
const BUILD_IT = "build it with cargo build --release -p deepsft-cli";
export const MODEL = join(ROOT, "models", "poster-a4");

/** Seed of the tests' frames. Training and the published figures use others. */
const UNSEEN_SEED = 7_700_001;

/** Least pixels of the object in a frame that is looked at: 1 % of the image. */
const MIN_AREA = 1300;

/** @param {string[]} args */
export async function deepsft(...args) {
  try {
    await promisify(execFile)(CLI, args, { maxBuffer: 1 << 26 });
  } catch (error) {
    throw new Error(
      `${CLI} ${args.join(" ")} failed (${BUILD_IT}): ${error.stderr || error.message}`,
      { cause: error },
    );
  }
}

/** What tests make, not kept by git. What has to find our Node.js packages is made here too. */
export const MADE = join(WWW, "tests", "made");
/** What the program made for the tests, some hundred megabytes: a folder for each version of it, for the two that were used last. */
const BY_PROGRAM = join(MADE, "by-program");
const VERSIONS_KEPT = 2;

/** @type {Promise<string> | undefined} */
let ofThisProgram;

/**
 * What a command of the program writes from its arguments alone: made once, and kept for the next run of the tests with the same program.
 *
 * @param {(string | { input: string })[]} args but `--out`; an input is a file or a folder, and counts by what it holds
 * @returns {Promise<string>} the folder, to be read only
 */
export async function made(...args) {
  const versions = await (ofThisProgram ??= folderOfThisProgram());
  const key = createHash("sha256");
  for (const arg of args) key.update(typeof arg === "string" ? `${arg}\n` : await hashOf(arg.input));
  const folder = join(versions, key.digest("hex").slice(0, 32));
  if (existsSync(folder)) return folder;
  const partial = await mkdtemp(`${folder}-`);
  try {
    await deepsft(...args.map((arg) => (typeof arg === "string" ? arg : arg.input)), "--out", partial);
    // Another file of tests may have made the same meanwhile.
    await rename(partial, folder).catch((error) => {
      if (!existsSync(folder)) throw error;
    });
  } finally {
    await rm(partial, { recursive: true, force: true });
  }
  return folder;
}

async function folderOfThisProgram() {
  if (!existsSync(CLI)) throw new Error(`${CLI} is missing (${BUILD_IT})`);
  const folder = join(BY_PROGRAM, (await hashOf(CLI)).slice(0, 16));
  await mkdir(folder, { recursive: true });
  await utimes(folder, new Date(), new Date());
  // Another file of tests may be throwing them away too.
  const lastUse = (path) => stat(path).then(({ mtimeMs }) => mtimeMs, () => 0);
  const versions = (await readdir(BY_PROGRAM)).map(async (name) => ({ path: join(BY_PROGRAM, name), used: await lastUse(join(BY_PROGRAM, name)) }));
  const older = (await Promise.all(versions)).sort((a, b) => b.used - a.used).slice(VERSIONS_KEPT);
  await Promise.all(older.map(({ path }) => rm(path, { recursive: true, force: true })));
  return folder;
}

/** SHA-256 of a file, or of the names and contents of a folder. */
async function hashOf(path) {
  const hash = createHash("sha256");
  const names = (await stat(path)).isDirectory() ? (await readdir(path, { recursive: true, withFileTypes: true })).filter((one) => one.isFile()) : null;
  if (!names) return hash.update(await readFile(path)).digest("hex");
  const files = names.map((one) => join(one.parentPath ?? one.path, one.name)).sort();
  for (const file of files) hash.update(file.slice(path.length)).update(await hashOf(file));
  return hash.digest("hex");
}

/**
 * @typedef {object} Frame
 * @property {string} name
 * @property {{ width: number, height: number, rgb: Uint8Array }} picture
 * @property {Buffer} png
 * @property {{ depth: Float32Array, registration: Float32Array }} truth
 * @property {{ depth_rmse_mm: number, registration_rmse_mm: number, mask_iou: number, found: boolean }} native errors of the native estimator
 */

/**
 * Synthetic frames that show the poster, with their truth and what `deepsft eval` says of them.
 *
 * @param {string} folder to work in
 * @param {number} count
 * @returns {Promise<Frame[]>}
 */
export async function unseenFrames(folder, count) {
  const report = join(folder, "eval.json");
  // Some frames show no poster, and some only a corner of it.
  const template = { input: join(MODEL, "template") };
  const dataset = await made("synth", "--template", template, "--count", String(2 * count), "--seed", String(UNSEEN_SEED));
  await deepsft("eval", "--model", MODEL, "--dataset", dataset, "--json", report);
  const { per_frame: measured } = JSON.parse(await readFile(report, "utf8"));
  const files = new Map();
  for (const shard of (await readdir(dataset)).filter((name) => name.endsWith(".tar")).sort()) {
    for (const [name, content] of untar(await readFile(join(dataset, shard)))) files.set(name, content);
  }
  const frames = [];
  const names = [...files.keys()]
    .filter((name) => name.endsWith(".rgb.png"))
    .map((name) => name.slice(0, -".rgb.png".length))
    .sort();
  for (const [index, name] of names.entries()) {
    const truth = readTruth(files, name);
    if (frames.length < count && truth.depth.filter((d) => d > 0).length >= MIN_AREA) {
      const png = files.get(`${name}.rgb.png`);
      const { width, height, values } = decodePng(png);
      frames.push({ name, png, picture: { width, height, rgb: values }, truth, native: measured[index] });
    }
  }
  if (frames.length < count) throw new Error(`only ${frames.length} of ${2 * count} frames show the poster`);
  return frames;
}

/** Unit of the dataset's depth images, mm, and the value that stands for u = 1 or v = 1. */
const DEPTH_UNIT_MM = 0.1;
const UV_ONE = 65535;

/**
 * The true maps of a frame: depth in tenths of a millimetre, 0 outside; u and v in red and green, blue 0 outside.
 *
 * @param {Map<string, Buffer>} files
 * @param {string} name
 */
export function readTruth(files, name) {
  const depths = decodePng(files.get(`${name}.depth.png`)).values;
  const uvs = decodePng(files.get(`${name}.uv.png`)).values;
  const depth = Float32Array.from(depths, (d) => (d === 0 ? -1 : d * DEPTH_UNIT_MM));
  const registration = new Float32Array(2 * depth.length);
  for (let i = 0; i < depth.length; i++) {
    for (let k = 0; k < 2; k++) registration[2 * i + k] = depths[i] === 0 ? -1 : uvs[3 * i + k] / UV_ONE;
  }
  return { depth, registration };
}

/**
 * What the native estimator answers for pictures as the browser saw them. `mesh` is the whole mesh, camera frame, mm, where
 * one was asked for and accepted.
 *
 * @param {string} folder to work in
 * @param {{ name: string, png: Buffer }[]} pictures
 * @param {object} camera
 * @param {"none" | "fit" | "complete"} [recovery] of the mesh
 * @returns {Promise<Map<string, { depth: Float32Array, registration: Float32Array, mask: Uint8Array, found: boolean, confidence: number, fitted: boolean, mesh: Float32Array | null }>>}
 */
export async function nativeEstimates(folder, pictures, camera, recovery = "none") {
  await mkdir(folder, { recursive: true });
  const { width, height, fx, fy, cx, cy, distortion } = camera;
  const cameraFile = join(folder, "camera.json");
  await writeFile(cameraFile, JSON.stringify({ width, height, fx, fy, cx, cy, distortion }));
  const images = pictures.map(({ name }) => join(folder, `${name}.png`));
  await Promise.all(pictures.map(({ png }, i) => writeFile(images[i], png)));
  const out = join(folder, "out");
  await deepsft(
    "reconstruct",
    ...["--model", MODEL, "--camera", cameraFile, "--mesh", recovery, "--out", out],
    ...images,
  );
  const answers = new Map();
  for (const { name } of pictures) {
    const read = async (map) => (await readNpy(join(out, name, `${map}.npy`))).values;
    const { found, confidence } = JSON.parse(await readFile(join(out, name, "report.json"), "utf8"));
    const [depth, registration, mask] = await Promise.all(["depth", "registration", "mask"].map(read));
    const file = join(out, name, "whole-mesh.glb");
    const mesh = existsSync(file) ? glbPositions(await readFile(file)) : null;
    answers.set(name, { depth, registration, mask, found, confidence, fitted: mesh !== null, mesh });
  }
  return answers;
}
