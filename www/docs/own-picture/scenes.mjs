// Makes the figures of own-picture.md: objects with a picture on them, photographed by a small renderer, found and fitted by the
// command line program. Squares of 10 mm are then drawn on the fitted mesh.
//
//     node scenes.mjs DEEPSFT FOLDER [NAME...]    writes NAME.png (the photograph), NAME-picture.png and NAME-mesh.png

import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { decodePng, encodePng } from "../../tests/support/png.mjs";

const [WIDTH, HEIGHT, FOCAL] = [960, 640, 800];
/** Rendered so many times larger along each side, then averaged. */
const SAMPLES = 2;
const POSTER = decodePng(readFileSync(new URL("../../../models/poster-a4/template/texture.png", import.meta.url)));

/** A part of the poster, fractions from its top left. */
function cut(left, top, right, bottom, length) {
  const [w, h] = [(right - left) * POSTER.width, (bottom - top) * POSTER.height];
  const scale = length / Math.max(w, h);
  const [width, height] = [Math.round(w * scale), Math.round(h * scale)];
  const values = new Uint8Array(3 * width * height);
  const n = Math.max(1, Math.round(1 / scale));
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      for (let k = 0; k < 3; k++) {
        let sum = 0;
        for (let j = 0; j < n; j++) {
          for (let i = 0; i < n; i++) {
            const column = Math.min(POSTER.width - 1, Math.floor(left * POSTER.width + (x + (i + 0.5) / n) / scale));
            const row = Math.min(POSTER.height - 1, Math.floor(top * POSTER.height + (y + (j + 0.5) / n) / scale));
            sum += POSTER.values[POSTER.channels * (row * POSTER.width + column) + k];
          }
        }
        values[3 * (y * width + x) + k] = sum / n ** 2;
      }
    }
  }
  return { width, height, values };
}

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

const matrix = (yaw, pitch, roll) => {
  const [a, b, c, d, e, f] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch), Math.cos(roll), Math.sin(roll)];
  return ([x, y, z]) => {
    const [x1, y1] = [e * x - f * y, f * x + e * y];
    const [y2, z2] = [c * y1 - d * z, d * y1 + c * z];
    return [a * x1 + b * z2, y2, -b * x1 + a * z2];
  };
};

/** A surface that unrolls: along the direction `turn` it bends by the angle `angle(s)`, radians, at arc length `s`, mm. */
const developable = (turn, angle) => (x, y) => {
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  const [along, across] = [c * x + s * y, -s * x + c * y];
  let [p, q] = [0, 0];
  const step = along / 64;
  for (let i = 0; i < 64; i++) {
    const at = angle((i + 0.5) * step);
    p += step * Math.cos(at);
    q += step * Math.sin(at);
  }
  return [c * p - s * across, s * p + c * across, q];
};

/** An image with depths, `SAMPLES` times too large. */
function newImage(color) {
  const [w, h] = [WIDTH * SAMPLES, HEIGHT * SAMPLES];
  const rgb = new Float32Array(3 * w * h);
  for (let y = 0; y < h; y++)
    for (let x = 0; x < w; x++) {
      const grain = 5 * Math.sin(0.013 * x + 4 * Math.sin(0.004 * y)) + 3 * Math.sin(0.21 * y + 3 * Math.sin(0.006 * x));
      for (let k = 0; k < 3; k++) rgb[3 * (y * w + x) + k] = color[k] + grain - (18 * Math.hypot(x - w / 2, y - h / 2)) / w;
    }
  return { w, h, rgb, depth: new Float32Array(w * h).fill(Infinity) };
}

/** Draws `point(u, v)`, mm in the camera's frame, with `color(u, v)`, over a grid. */
function draw(image, point, color, [columns, lines]) {
  const corner = (i, j) => ({ at: point(i / columns, j / lines), uv: [i / columns, j / lines] });
  for (let j = 0; j < lines; j++) {
    for (let i = 0; i < columns; i++) {
      const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
      drawTriangle(image, [a, b, c], color);
      drawTriangle(image, [a, c, d], color);
    }
  }
}

function drawTriangle({ w, h, rgb, depth }, corners, color) {
  const [p, q, r] = corners.map(({ at }) => at);
  const [e, f] = [q.map((c, k) => c - p[k]), r.map((c, k) => c - p[k])];
  const normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
  const towards = (normal[2] > 0 ? -1 : 1) / Math.hypot(...normal);
  const light = [-0.45, -0.65, -0.61];
  const shade = 0.5 + 0.6 * Math.max(0, towards * normal.reduce((sum, c, k) => sum + c * light[k], 0));
  const project = ([x, y, z]) => [(SAMPLES * FOCAL * x) / z + w / 2, (SAMPLES * FOCAL * y) / z + h / 2, z];
  const [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [p, q, r].map(project);
  const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
  if (Math.abs(area) < 1e-9) return;
  for (let y = Math.max(0, Math.floor(Math.min(ay, by, cy))); y <= Math.min(h - 1, Math.max(ay, by, cy)); y++) {
    for (let x = Math.max(0, Math.floor(Math.min(ax, bx, cx))); x <= Math.min(w - 1, Math.max(ax, bx, cx)); x++) {
      const [px, py] = [x + 0.5, y + 0.5];
      const beta = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area;
      const gamma = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area;
      const weights = [1 - beta - gamma, beta, gamma];
      if (Math.min(...weights) < -1e-6) continue;
      const z = weights[0] * az + weights[1] * bz + weights[2] * cz;
      if (z >= depth[y * w + x]) continue;
      depth[y * w + x] = z;
      const [u, v] = [0, 1].map((k) => corners.reduce((sum, { uv }, i) => sum + weights[i] * uv[k], 0));
      const value = color(u, v);
      for (let k = 0; k < 3; k++) rgb[3 * (y * w + x) + k] = value[k] * shade;
    }
  }
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

/** The photograph: averaged, with a camera's noise, if it is one. */
function developed({ w, rgb }, grain = 5) {
  const values = new Uint8Array(3 * WIDTH * HEIGHT);
  let state = 1;
  const noise = () => ((state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0) / 2 ** 31 - 1) * grain;
  for (let y = 0; y < HEIGHT; y++)
    for (let x = 0; x < WIDTH; x++)
      for (let k = 0; k < 3; k++) {
        let sum = 0;
        for (let j = 0; j < SAMPLES; j++) for (let i = 0; i < SAMPLES; i++) sum += rgb[3 * ((y * SAMPLES + j) * w + x * SAMPLES + i) + k];
        values[3 * (y * WIDTH + x) + k] = Math.min(255, Math.max(0, sum / SAMPLES ** 2 + noise()));
      }
  return { width: WIDTH, height: HEIGHT, values };
}

const sampled = ({ width, height, values }) => (u, v) => {
  const at = 3 * (Math.min(height - 1, Math.floor(v * height)) * width + Math.min(width - 1, Math.floor(u * width)));
  return values.subarray(at, at + 3);
};

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
