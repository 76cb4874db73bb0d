// Makes the figures of own-picture.md: objects with a picture on them, photographed by a small renderer, found and fitted by the
// command line program. Squares of 10 mm are then drawn on the fitted mesh.
//
//     node scenes.mjs DEEPSFT FOLDER [NAME...]    writes NAME.png (the photograph), NAME-picture.png and NAME-mesh.png

import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { encodePng } from "../../tests/support/png.mjs";
import { FOCAL, HEIGHT, SAMPLES, WIDTH, cut, developable, developed, draw, drawTriangle, matrix, newImage, sampled } from "../renderer.mjs";

/** A motif in rows: every part of it looks like another. */
function rows(width, height) {
  const values = new Uint8Array(3 * width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const [i, j] = [(x % 64) - 32, (y % 64) - 32];
      const inDrop = Math.hypot(i, j) < 18 && !(Math.hypot(i - 6, j + 4) < 7);
      values.set(inDrop ? [30, 90, 150] : [240, 232, 214], 3 * (y * width + x));
    }
  }
  return { width, height, values };
}

/** A name on plain paper. */
function plain(width, height) {
  const values = new Uint8Array(3 * width * height);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) values.set(Math.hypot(x - 0.15 * width, y - 0.5 * height) < 0.1 * height ? [190, 50, 40] : [238, 236, 230], 3 * (y * width + x));
  return { width, height, values };
}

/** An image to draw on that shows a photograph already. */
function imageOf({ values }) {
  const image = newImage([0, 0, 0]);
  for (let y = 0; y < image.h; y++)
    for (let x = 0; x < image.w; x++)
      for (let k = 0; k < 3; k++)
        image.rgb[3 * (y * image.w + x) + k] = values[3 * (Math.floor(y / SAMPLES) * WIDTH + Math.floor(x / SAMPLES)) + k];
  return image;
}

/** Corners of the faces of a .glb file's first mesh: mm in the camera's frame, with texture coordinates. */
function facesOf(file) {
  const jsonLength = file.readUInt32LE(12);
  const { accessors, bufferViews, meshes } = JSON.parse(file.toString("utf8", 20, 20 + jsonLength));
  const { attributes, indices } = meshes[0].primitives[0];
  const startOf = ({ bufferView, byteOffset = 0 }) => 28 + jsonLength + (bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
  const [positions, uvs, faces] = [accessors[attributes.POSITION], accessors[attributes.TEXCOORD_0], accessors[indices]];
  const corners = Array.from({ length: positions.count }, (_, i) => ({
    at: [0, 1, 2].map((k) => file.readFloatLE(startOf(positions) + 4 * (3 * i + k)) * (k === 0 ? 1000 : -1000)),
    uv: [0, 1].map((k) => file.readFloatLE(startOf(uvs) + 4 * (2 * i + k))),
  }));
  const wide = faces.componentType === 5125;
  const index = (i) => (wide ? file.readUInt32LE(startOf(faces) + 4 * i) : file.readUInt16LE(startOf(faces) + 2 * i));
  return Array.from({ length: faces.count / 3 }, (_, i) => [0, 1, 2].map((k) => corners[index(3 * i + k)]));
}

/** Squares of 10 mm. */
const squares = ([width, height]) => (u, v) =>
  (Math.floor((u * width) / 10) + Math.floor((v * height) / 10)) % 2 ? [23, 83, 92] : [246, 222, 184];

/** @typedef {{ picture: ReturnType<typeof cut>, sizeMm: [number, number], bend: (x: number, y: number) => number[], turned: ReturnType<typeof matrix>, at: [number, number, number], behind?: { size: [number, number], color: number[] } }} Scene */

const flat = developable(0, () => 0);
const around = (radius) => developable(0, (s) => s / radius);
/** @type {Record<string, Scene>} */
const SCENES = {
  postcard: { picture: cut(0.02, 0.03, 0.62, 0.63, 900), sizeMm: [148, 104], bend: developable(0.6, (s) => 0.006 * s), turned: matrix(0.35, 0.5, -0.2), at: [10, 5, 215] },
  "book-cover": { picture: cut(0.03, 0.02, 0.5, 0.98, 1000), sizeMm: [140, 202], bend: developable(0.15, (s) => 0.000045 * (s + 70) ** 2), turned: matrix(-0.45, 0.25, 0.12), at: [-15, 8, 285] },
  "t-shirt": { picture: cut(0.3, 0.05, 0.98, 0.97, 1000), sizeMm: [260, 249], bend: developable(0.35, (s) => 0.5 * Math.sin(s / 17) + 0.25 * Math.sin(s / 41 + 1)), turned: matrix(0.25, -0.15, 0.05), at: [0, 0, 520], behind: { size: [430, 420], color: [58, 74, 96] } },
  bottle: { picture: cut(0.05, 0.3, 0.95, 0.95, 1000), sizeMm: [110, 56], bend: around(38), turned: matrix(0.3, 0.15, 0.05), at: [0, 0, 210], behind: { size: [238, 260], color: [34, 62, 44] } },
  "bottle-all-around": { picture: cut(0.02, 0.2, 0.98, 0.65, 1000), sizeMm: [220, 73], bend: around(38), turned: matrix(0.3, 0.15, 0.05), at: [0, 0, 230], behind: { size: [238, 260], color: [34, 62, 44] } },
  rows: { picture: rows(896, 640), sizeMm: [210, 150], bend: flat, turned: matrix(0.3, 0.3, 0.1), at: [0, 0, 330] },
  plain: { picture: plain(840, 600), sizeMm: [210, 150], bend: flat, turned: matrix(0.3, 0.3, 0.1), at: [0, 0, 330] },
};

const [program, folder, ...names] = process.argv.slice(2);
for (const [name, { picture, sizeMm, bend, turned, at, behind }] of Object.entries(SCENES)) {
  if (names.length > 0 && !names.includes(name)) continue;
  const image = newImage([172, 158, 140]);
  const placed = (x, y, inwards) => {
    const [px, py, pz] = bend(x, y);
    return turned([px, py, pz + inwards]).map((c, k) => c + at[k]);
  };
  if (behind) draw(image, (u, v) => placed((u - 0.5) * behind.size[0], (v - 0.5) * behind.size[1], 0.6), () => behind.color, [200, 60]);
  draw(image, (u, v) => placed((u - 0.5) * sizeMm[0], (v - 0.5) * sizeMm[1], 0), sampled(picture), [160, 90]);
  const work = join(folder, name);
  mkdirSync(work, { recursive: true });
  const photograph = developed(image);
  const [photo, print, camera, mesh] = [`${name}.png`, `${name}-picture.png`, `${name}.json`, `${name}-mesh.png`].map((file) => join(folder, file));
  writeFileSync(print, encodePng(picture));
  writeFileSync(photo, encodePng(photograph));
  const intrinsics = { width: WIDTH, height: HEIGHT, fx: FOCAL, fy: FOCAL, cx: WIDTH / 2, cy: HEIGHT / 2, distortion: [0, 0, 0, 0, 0] };
  writeFileSync(camera, JSON.stringify(intrinsics));
  const options = ["--picture", print, "--size-mm", sizeMm.join("x"), "--camera", camera, "--mesh", "fit", "--out", work, photo];
  console.log(execFileSync(program, ["reconstruct", ...options], { encoding: "utf8" }).trim());
  const fitted = join(work, name, "whole-mesh.glb");
  if (!existsSync(fitted) || !JSON.parse(readFileSync(join(work, name, "report.json"))).found) continue;
  const shown = imageOf(photograph);
  const apart = facesOf(readFileSync(fitted)).flat().map(({ at: found, uv: [u, v] }) => {
    const truth = placed((u - 0.5) * sizeMm[0], (v - 0.5) * sizeMm[1], 0);
    return { mm: Math.hypot(...truth.map((c, k) => c - found[k])), px: FOCAL * Math.hypot(...[0, 1].map((k) => truth[k] / truth[2] - found[k] / found[2])) };
  });
  for (const unit of ["px", "mm"]) {
    const sorted = apart.map((one) => one[unit]).sort((a, b) => a - b);
    console.log(`  ${unit}: median ${sorted[sorted.length >> 1].toFixed(2)}, 95 % below ${sorted[Math.floor(0.95 * sorted.length)].toFixed(2)}`);
  }
  for (const corners of facesOf(readFileSync(fitted))) drawTriangle(shown, corners, squares(sizeMm));
  writeFileSync(mesh, encodePng(developed(shown, 0)));
}
