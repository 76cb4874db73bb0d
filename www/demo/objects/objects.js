// The things that can stand on the sheet: a house in its garden, a boat on the water, a sundial. Each stands in a circle of radius 1.

import { Solids } from "./solids.js";

/** @import { Point } from "./solids.js" */

/** @typedef {"house" | "boat" | "sundial"} ObjectName */

/** @type {Readonly<Record<ObjectName, () => Solids>>} */
export const OBJECTS = { house, boat, sundial };

function house() {
  const solids = new Solids().paint("#6f9e4c").lathe([[0.97, 0], [1, 0.03], [0.94, 0.07], [0, 0.07]]);
  solids.paint("#d9cdb4");
  for (const [x, z, size] of [[0.1, 0.42, 0.2], [0.13, 0.62, 0.18], [0.08, 0.8, 0.2]]) solids.lathe([[size / 2, 0.07], [size / 2, 0.085], [0, 0.085]], { at: [x, z], sides: 7 });
  const [half, back, front, eaves, ridge] = [0.5, -0.42, 0.28, 0.46, 0.82];
  const middle = (back + front) / 2;
  solids.paint("#f3e6cf").box([0, 0.07, middle], [2 * half, eaves - 0.07, front - back]);
  for (const x of [-half, half]) solids.triangles([x, eaves, front], [x, eaves, back], [x, ridge, middle]);
  // The roof juts out over the walls; its underside is the same plane a little lower.
  const [jut, thick] = [0.09, 0.05];
  const slope = (ridge - eaves) / (front - middle);
  for (const side of [-1, 1]) {
    const foot = middle + side * (front - middle + jut);
    const low = eaves - slope * jut;
    const plane = (/** @type {number} */ lift) =>
      /** @type {Point[]} */ ([[-half - jut, low + lift, foot], [half + jut, low + lift, foot], [half + jut, ridge + lift, middle], [-half - jut, ridge + lift, middle]]);
    solids.paint(side > 0 ? "#c4563a" : "#b44d33").plate(plane(0.01), [0, thick, 0]);
  }
  solids.paint("#e8d9c0").box([-0.28, 0.6, middle - 0.12], [0.15, 0.42, 0.15]).paint("#7c4433").box([-0.28, 1.02, middle - 0.12], [0.19, 0.05, 0.19]);
  solids.paint("#2f6f6a").box([0.1, 0.07, front], [0.17, 0.28, 0.04]);
  for (const x of [-0.26, 0.36]) {
    solids.paint("#ffffff").box([x, 0.19, front], [0.2, 0.19, 0.03]);
    solids.paint("#ffd777").box([x, 0.205, front + 0.012], [0.16, 0.16, 0.03]);
  }
  for (const [x, z, size] of [[-0.68, 0.34, 1], [0.7, 0.2, 0.75], [-0.66, -0.42, 0.8]]) {
    solids.paint("#7a5638").lathe([[0.05 * size, 0.07], [0.04 * size, 0.25 * size]], { at: [x, z], sides: 6 });
    for (const [radius, from, to, color] of /** @type {const} */ ([[0.23, 0.2, 0.56, "#38704a"], [0.18, 0.4, 0.74, "#41805a"], [0.12, 0.6, 0.92, "#4d9066"]]))
      solids.paint(color).lathe([[0, from * size], [radius * size, from * size], [0, to * size]], { at: [x, z], sides: 8 });
  }
  return solids;
}

function boat() {
  const solids = new Solids().paint("#2d7fb0").lathe([[0.97, 0], [1, 0.03], [0.95, 0.06], [0, 0.06]], { sides: 32 });
  solids.paint("#6fb6d9");
  for (const radius of [0.86, 0.62]) solids.lathe([[radius + 0.025, 0.061], [radius, 0.075], [radius - 0.025, 0.061]], { sides: 32 });
  // The hull, from stern (a = 0) to bow: its half width, and the height of its edge.
  const width = (/** @type {number} */ a) => 0.25 * Math.min(1, 0.62 + 1.1 * a) * Math.sqrt(Math.max(0, 1 - a ** 3));
  const edge = (/** @type {number} */ a) => 0.27 + 0.12 * (a - 0.35) ** 2;
  const along = (/** @type {number} */ a) => -0.66 + 1.38 * a;
  for (const side of [-1, 1]) {
    const band = (/** @type {[number, number]} */ [low, high], /** @type {[number, number]} */ [from, to]) => (/** @type {number} */ a, /** @type {number} */ b) =>
      /** @type {Point} */ ([along(a), edge(a) * (low + b * (high - low)), side * width(a) * (from + b * (to - from))]);
    solids.paint("#b8352c", true).surface(band([0.1, 0.62], [0.45, 0.9]), 14, 2);
    solids.paint("#fbfaf4", true).surface(band([0.62, 1], [0.9, 1]), 14, 1);
  }
  solids.paint("#fbfaf4", true).quad([along(0), 0.03, -0.07], [along(0), 0.03, 0.07], [along(0), edge(0), width(0)], [along(0), edge(0), -width(0)]);
  solids.paint("#bd8f5a", true).surface((a, b) => [along(a), edge(a) - 0.03, (2 * b - 1) * 0.97 * width(a)], 14, 1);
  solids.paint("#f0e2c8", true).box([-0.22, 0.24, 0], [0.34, 0.13, 0.22]).paint("#6d4a2f", true).box([-0.22, 0.37, 0], [0.38, 0.025, 0.26]);
  solids.lathe([[0.022, 0.25], [0.014, 1.46]], { at: [0.1, 0], sides: 8 }).plate([[0.1, 0.47, -0.012], [-0.6, 0.45, -0.012], [-0.6, 0.475, -0.012], [0.1, 0.5, -0.012]], [0, 0, 0.024]);
  // Sails: triangles that the wind fills.
  const sail = (/** @type {Point} */ foot, /** @type {Point} */ head, /** @type {Point} */ clew, /** @type {number} */ full) => (/** @type {number} */ a, /** @type {number} */ b) => {
    const out = a * (1 - b);
    const at = (/** @type {number} */ k) => foot[k] + b * (head[k] - foot[k]) + out * (clew[k] - foot[k]);
    return /** @type {Point} */ ([at(0), at(1), at(2) + full * Math.sin(Math.PI * a) * (1 - b) * (0.4 + b)]);
  };
  solids.paint("#fffaf0", true).surface(sail([0.08, 0.52, 0], [0.09, 1.42, 0], [-0.58, 0.5, 0], 0.24), 6, 8);
  solids.paint("#f2a541", true).surface(sail([0.12, 0.42, 0], [0.11, 1.22, 0], [0.7, 0.36, 0], 0.16), 6, 8);
  solids.paint("#b8352c", true).plate([[0.1, 1.46, 0], [0.1, 1.38, 0], [-0.08, 1.42, 0]], [0, 0, 0.01]);
  return solids;
}

function sundial() {
  const solids = new Solids().paint("#b9b0a2").lathe([[0.97, 0], [1, 0.03], [1, 0.12], [0.97, 0.15], [0, 0.15]], { sides: 36 });
  solids.paint("#d8d0c2").lathe([[0.84, 0.15], [0.84, 0.24], [0.8, 0.27], [0, 0.27]], { sides: 36 });
  solids.paint("#9a7a3f").lathe([[0.78, 0.27], [0.78, 0.295], [0.74, 0.3], [0.7, 0.295], [0.7, 0.27]], { sides: 36 });
  // Six in the morning lies on the left, noon at the top.
  for (let hour = 6; hour <= 18; hour++) {
    const angle = (Math.PI * (18 - hour)) / 12;
    const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
    const isLong = hour % 3 === 0;
    const [from, to, half] = [isLong ? 0.44 : 0.54, 0.66, isLong ? 0.02 : 0.012];
    const at = (/** @type {number} */ radius, /** @type {number} */ across) => /** @type {Point} */ ([radius * cosine - across * sine, 0.276, -(radius * sine + across * cosine) + 0.1]);
    solids.paint("#4d4436").plate([at(from, -half), at(to, -half), at(to, half), at(from, half)], [0, 0.012, 0]);
  }
  solids.paint("#b08a45").plate([[-0.025, 0.27, 0.32], [-0.025, 0.27, -0.42], [-0.025, 0.86, -0.42]], [0.05, 0, 0]);
  return solids;
}
