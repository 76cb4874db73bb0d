// A scan of a person's own object, and the flat sheet it unrolls to.

import { addressOf, isAddress } from "../address.js";
import { fetchBytes, filesByName } from "../engine/bundle.js";
import { vertexNormals } from "../results/surface-mesh.js";
import { unzipped } from "./zip.js";

/** @import { readScan } from "../../pkg/deepsft_web.js" */

/**
 * The files of a scan: the address of a `.glb` or `.zip`, one file, several as a file input gives them, or the files by name. A `.glb` is
 * one file, a `.zip` holds all. A `.obj` comes with its `.mtl` and pictures, or with one picture; a `.gltf` and a `.ply` with what they name.
 *
 * @typedef {string | URL | File | Iterable<File> | Map<string, Uint8Array>} ScanInput
 */

/** A scan. `DeepSft` reads it. */
export class Scan {
  /**
   * @param {Awaited<ReturnType<typeof readScan>>} raw
   * @param {Map<string, Uint8Array>} files
   */
  constructor({ name, mmPerUnit, vertices, mesh, texture, sheet, refusal, notes }, files) {
    /** Its files, by name. */
    this.files = files;
    /** Name of its file. */
    this.name = name;
    /** Millimetres of the file's unit, as they were taken. */
    this.mmPerUnit = mmPerUnit;
    /** (x, y, z) of each vertex, mm: x right, y down, the front towards -z; its middle is the origin. */
    this.vertices = vertices;
    /** Unit normals (x, y, z) of the vertices. */
    this.normals = vertexNormals(vertices, mesh.faces, new Float32Array(vertices.length));
    /** Faces and texture coordinates. */
    this.mesh = mesh;
    /** Its texture. */
    this.texture = pictureOf(texture);
    /**
     * The flat sheet that it unrolls to: what is looked for. `backMm` is how far its back is away, which the scan has too and which was
     * left out, or null. Null of an object with a volume.
     *
     * @type {{ picture: ImageData, widthMm: number, heightMm: number, backMm: number | null } | null}
     */
    this.sheet = sheet && { picture: pictureOf(sheet.picture), widthMm: sheet.sizeMm[0], heightMm: sheet.sizeMm[1], backMm: sheet.backMm };
    /** Why it is no sheet but an object with a volume, for people; null of a sheet. */
    this.refusal = refusal;
    /** What was put right, left out or made anew, for people. */
    this.notes = notes;
  }

  /** Sides of the box around it, mm: width, height and depth. @returns {[number, number, number]} */
  get sizeMm() {
    const side = (/** @type {number} */ axis) => {
      const places = this.vertices.filter((_, i) => i % 3 === axis);
      return places.reduce((a, b) => Math.max(a, b), -Infinity) - places.reduce((a, b) => Math.min(a, b), Infinity);
    };
    return [side(0), side(1), side(2)];
  }
}

/** @param {{ width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer> }} raw */
function pictureOf({ width, height, rgba }) {
  return new ImageData(rgba, width, height);
}

/**
 * @param {ScanInput} input
 * @returns {Promise<Map<string, Uint8Array>>} by name; archives unpacked
 * @throws {import("../error.js").DeepSftError} `model-load`, `target-unusable`
 */
export async function scanFiles(input) {
  const files = [...(await filesOf(input))].map(([name, bytes]) => (/\.zip$/i.test(name) ? unzipped(name, bytes) : [[name, bytes]]));
  return new Map(/** @type {[string, Uint8Array][]} */ ((await Promise.all(files)).flat()));
}

/** @param {ScanInput} input */
async function filesOf(input) {
  if (input instanceof Map) return input;
  if (isAddress(input)) {
    const url = addressOf(input);
    return new Map([[url.pathname.split("/").at(-1) ?? "", await fetchBytes(url, undefined)]]);
  }
  return filesByName(input instanceof Blob ? [input] : input);
}
