// A small renderer for the figures of these pages: bent sheets with parts of the poster on them, before a plain cloth.

import { readFileSync } from "node:fs";

import { decodePng } from "../tests/support/png.mjs";

export const [WIDTH, HEIGHT, FOCAL] = [960, 640, 800];
/** Rendered so many times larger along each side, then averaged. */
export const SAMPLES = 2;
const POSTER = decodePng(readFileSync(new URL("../../models/poster-a4/template/texture.png", import.meta.url)));

/** A part of the poster, fractions from its top left. */
export function cut(left, top, right, bottom, length) {
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

export const matrix = (yaw, pitch, roll) => {
  const [a, b, c, d, e, f] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch), Math.cos(roll), Math.sin(roll)];
  return ([x, y, z]) => {
    const [x1, y1] = [e * x - f * y, f * x + e * y];
    const [y2, z2] = [c * y1 - d * z, d * y1 + c * z];
    return [a * x1 + b * z2, y2, -b * x1 + a * z2];
  };
};

/** A surface that unrolls: along the direction `turn` it bends by the angle `angle(s)`, radians, at arc length `s`, mm. */
export const developable = (turn, angle) => (x, y) => {
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
export function newImage(color) {
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
export function draw(image, point, color, [columns, lines]) {
  const corner = (i, j) => ({ at: point(i / columns, j / lines), uv: [i / columns, j / lines] });
  for (let j = 0; j < lines; j++) {
    for (let i = 0; i < columns; i++) {
      const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
      drawTriangle(image, [a, b, c], color);
      drawTriangle(image, [a, c, d], color);
    }
  }
}

export function drawTriangle({ w, h, rgb, depth }, corners, color) {
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

/** The photograph: averaged, with a camera's noise, if it is one. */
export function developed({ w, rgb }, grain = 5) {
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

export const sampled = ({ width, height, values }) => (u, v) => {
  const at = 3 * (Math.min(height - 1, Math.floor(v * height)) * width + Math.min(width - 1, Math.floor(u * width)));
  return values.subarray(at, at + 3);
};
