import assert from "node:assert/strict";
import { test } from "node:test";

import { SheetLight } from "deepsft/light";

const unit = (v) => v.map((x) => x / Math.hypot(...v));
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Normals of a sheet that bends by `bend` radians to each side about an upright axis, and by half of it about a level one. */
function normalsOf(bend) {
  const normals = [];
  for (let i = -10; i <= 10; i++) for (let j = -5; j <= 5; j++) normals.push(...unit([Math.sin((i / 10) * bend), Math.sin((j / 10) * bend), -1]));
  return Float32Array.from(normals);
}

/** The light on each of them. */
function lightOn(normals, everywhere, directed) {
  return Float32Array.from({ length: normals.length / 3 }, (_, i) => everywhere + Math.max(0, dot(directed, normals.subarray(3 * i, 3 * i + 3))));
}

test("on a bent sheet the light is found to come from where it does", () => {
  const normals = normalsOf(1);
  const directed = [0.5, -0.3, -0.6];
  const light = new SheetLight();
  light.follow(lightOn(normals, 0.3, directed), normals, new Float32Array(normals.length / 3).fill(1), 0);
  const { directed: found, everywhere } = light.light;
  const off = Math.acos(dot(unit(found), unit(directed)));
  // The usual light, which counts for 3 %, comes from the other side.
  assert.ok(off < (12 * Math.PI) / 180, `${(off * 180) / Math.PI} degrees off`);
  assert.ok(Math.abs(everywhere + dot(found, [0, 0, -1]) - 0.9) < 0.05, "as bright on a sheet that faces the camera");
});

test("on a flat sheet it comes from above on the left, and is as bright as the sheet", () => {
  const normals = normalsOf(0);
  const light = new SheetLight();
  light.follow(new Float32Array(normals.length / 3).fill(0.5), normals, new Float32Array(normals.length / 3).fill(1), 0);
  const { directed, everywhere } = light.light;
  assert.ok(directed[0] < 0 && directed[1] < 0 && directed[2] < 0, `${directed}`);
  assert.ok(Math.abs(everywhere + dot(directed, [0, 0, -1]) - 0.5) < 0.02);
});

test("what is covered does not count, and with nothing seen the light stays", () => {
  const normals = normalsOf(0);
  const count = normals.length / 3;
  const [first, second] = [new SheetLight(), new SheetLight()];
  const values = Float32Array.from({ length: count }, (_, i) => (i % 2 === 0 ? 0.8 : 5));
  first.follow(values, normals, Float32Array.from({ length: count }, (_, i) => (i % 2 === 0 ? 1 : 0)), 0);
  second.follow(new Float32Array(count).fill(0.8), normals, new Float32Array(count).fill(1), 0);
  assert.ok(Math.abs(first.light.everywhere - second.light.everywhere) < 1e-6);
  const before = second.light;
  second.follow(values, normals, new Float32Array(count), 1000);
  assert.equal(second.light, before);
});
