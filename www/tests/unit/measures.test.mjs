import assert from "node:assert/strict";
import { test } from "node:test";

import { SurfaceMesh, measureSheet } from "deepsft";
import { isNews, measuresInWords } from "../../demo/live/measures.js";

const [COLUMNS, LINES] = [40, 30];
const RAD = Math.PI / 180;

/** A sheet of 200 x 150 mm; `at(s, t)` is where the place (s, t), mm from its middle, lies. */
function sheet(at) {
  const places = Array.from({ length: (COLUMNS + 1) * (LINES + 1) }, (_, i) => [(i % (COLUMNS + 1)) / COLUMNS, Math.floor(i / (COLUMNS + 1)) / LINES]);
  const faces = Array.from({ length: COLUMNS * LINES }, (_, i) => {
    const a = Math.floor(i / COLUMNS) * (COLUMNS + 1) + (i % COLUMNS);
    return [a, a + COLUMNS + 1, a + 1, a + 1, a + COLUMNS + 1, a + COLUMNS + 2];
  }).flat();
  return new SurfaceMesh(
    { vertices: Float32Array.from(places.flatMap(([u, v]) => at(200 * (u - 0.5), 150 * (v - 0.5)))), confidence: new Float32Array(places.length) },
    { faces: Uint32Array.from(faces), textureCoordinates: Float32Array.from(places.flat()) },
    "fit",
  );
}

/** Rolled up by an angle about the axis y, its middle at (30, 40, 400), then turned about that. */
const rolled = (degrees, turn = ([x, y, z]) => [x, y, z]) =>
  sheet((s, t) => {
    const radius = 200 / (degrees * RAD);
    const [x, y, z] = turn([radius * Math.sin(s / radius), t, radius * (1 - Math.cos(s / radius))]);
    return [30 + x, 40 + y, 400 + z];
  });

const near = (is, wanted, error) => assert.ok(Math.abs(is - wanted) <= error, `${is}, not ${wanted}`);

test("a cylinder bends by nine tenths of its angle, however it is turned, and its middle is as far as it is", () => {
  const tilted = ([x, y, z]) => [x, 0.6 * y - 0.8 * z, 0.8 * y + 0.6 * z];
  for (const degrees of [20, 60, 120, 200]) {
    for (const mesh of [rolled(degrees), rolled(degrees, tilted), rolled(-degrees)]) {
      const { bendDegrees, distanceMm } = measureSheet(mesh);
      near(bendDegrees, 0.9 * degrees, 0.03 * degrees);
      near(distanceMm, Math.hypot(30, 40, 400), 0.2);
    }
  }
});

test("a flat sheet does not bend, wherever it looks, and a fold bends by its angle", () => {
  const flat = sheet((s, t) => [s, 0.6 * t, 300 + 0.8 * t]);
  near(measureSheet(flat).bendDegrees, 0, 0.01);
  const folded = sheet((s, t) => [s * Math.cos(0.5), t, 300 + Math.abs(s) * Math.sin(0.5)]);
  near(measureSheet(folded).bendDegrees, 1 / RAD, 0.5);
});

test("single wild vertices change nothing", () => {
  const mesh = rolled(60);
  for (const vertex of [0, 333, 900]) mesh.vertices[3 * vertex + 2] += 30;
  near(measureSheet(mesh).bendDegrees, 54, 3);
});

test("a place between the vertices lies on the surface, and one beside the picture nowhere", () => {
  const mesh = sheet((s, t) => [s, t, 300 + s]);
  mesh.pointAt(0.513, 0.777).forEach((value, k) => near(value, [200 * 0.013, 150 * 0.277, 302.6][k], 0.001));
  assert.throws(() => mesh.pointAt(1.2, 0.5), { code: "invalid-argument" });
});

test("the measures in words", () => {
  const both = { bend: true, distance: true };
  assert.equal(measuresInWords({ distanceMm: 412, bendDegrees: 37.6 }, false, both), "Bent by 38°, 41 cm away");
  assert.equal(measuresInWords({ distanceMm: 1240, bendDegrees: 3 }, true, both), "Flat, about 1.2 m away");
  assert.equal(measuresInWords({ distanceMm: 996, bendDegrees: 90 }, false, both), "Bent by 90°, 1.0 m away");
  assert.equal(measuresInWords({ distanceMm: 412, bendDegrees: 37.6 }, true, { bend: false, distance: true }), "About 41 cm away");
  assert.equal(measuresInWords({ distanceMm: 412, bendDegrees: 37.6 }, true, { bend: true, distance: false }), "Bent by 38°");
});

test("only what changed much is read out", () => {
  const before = { distanceMm: 400, bendDegrees: 30 };
  assert.equal(isNews(null, before), true);
  assert.equal(isNews(before, { distanceMm: 420, bendDegrees: 38 }), false);
  assert.equal(isNews(before, { distanceMm: 400, bendDegrees: 45 }), true);
  assert.equal(isNews(before, { distanceMm: 480, bendDegrees: 30 }), true);
});
