import assert from "node:assert/strict";
import { test } from "node:test";

import { SurfaceMesh, SurfacePose, verticesInImage } from "deepsft";
import { scaledDepth } from "../../src/results/estimate.js";

/** A square of two faces in the plane z = 500 mm whose printed side looks at the camera, as the template's mesh is wound. */
const square = (vertices) =>
  new SurfaceMesh(
    { vertices: Float32Array.from(vertices.flat()), confidence: new Float32Array(4) },
    { faces: Uint32Array.of(0, 2, 3, 0, 3, 1), textureCoordinates: Float32Array.of(0, 0, 1, 0, 0, 1, 1, 1) },
    "tracking",
  );

test("normals of a frontal sheet look at the camera", () => {
  const mesh = square([
    [-10, -10, 500],
    [10, -10, 500],
    [-10, 10, 500],
    [10, 10, 500],
  ]);
  for (let i = 0; i < 4; i++) assert.deepEqual([...mesh.normals.subarray(3 * i, 3 * i + 3)], [0, 0, -1]);
  assert.equal(mesh.normals, mesh.normals, "computed once");
});

test("at a fold a normal is the mean of both sides by their area, and has length 1", () => {
  // The second face stands upright along the diagonal: its normal is another one.
  const mesh = square([
    [0, 0, 500],
    [10, 0, 490],
    [0, 10, 500],
    [10, 10, 500],
  ]);
  const normal = [...mesh.normals.subarray(0, 3)];
  // Faces (0, 2, 3): (0, 0, -100); (0, 3, 1): (b - a) x (c - a) = (10, 10, 0) x (10, 0, -10) = (-100, 100, -100).
  const expected = [-100, 100, -200].map((n) => n / Math.hypot(100, 100, 200));
  for (let k = 0; k < 3; k++) assert.ok(Math.abs(normal[k] - expected[k]) < 1e-6, `${normal}`);
});

test("a vertex of a face without area has a normal of length 0, not NaN", () => {
  const mesh = square(Array(4).fill([1, 2, 500]));
  assert.ok(mesh.normals.every((n) => n === 0));
});

const CAMERA = { width: 640, height: 480, fx: 500, fy: 510, cx: 310, cy: 250, distortion: [-0.1, 0.02, 0, 0, 0] };

test("the place at a pixel is the place that is seen there", () => {
  // Turned, so that one side is nearer by a third.
  const mesh = square([
    [-100, -60, 400],
    [100, -60, 600],
    [-100, 60, 400],
    [100, 60, 600],
  ]);
  for (const [u, v] of [[0.2, 0.3], [0.5, 0.5], [0.9, 0.2], [0.05, 0.95]]) {
    const [x, y] = verticesInImage(Float32Array.from(mesh.pointAt(u, v)), CAMERA);
    const place = mesh.placeAt(x, y, CAMERA);
    // A lens bends the sides of faces a little.
    assert.ok(place && Math.hypot(place[0] - u, place[1] - v) < 0.01, `${place} at ${u}, ${v}`);
  }
  assert.equal(mesh.placeAt(5, 5, CAMERA), null);
});

test("of a sheet that lies before itself the nearest place counts, and its back hides", () => {
  // The right half is folded over the left one, its back outside.
  const fold = new SurfaceMesh(
    { vertices: Float32Array.of(-50, -50, 500, 50, -50, 500, -50, 50, 500, 50, 50, 500, -20, -50, 480, -20, 50, 480), confidence: new Float32Array(6) },
    { faces: Uint32Array.of(0, 2, 3, 0, 3, 1, 1, 3, 5, 1, 5, 4), textureCoordinates: Float32Array.of(0, 0, 0.5, 0, 0, 1, 0.5, 1, 1, 0, 1, 1) },
    "tracking",
  );
  const at = (x, z) => fold.placeAt(...verticesInImage(Float32Array.of(x, 0, z), CAMERA), CAMERA);
  assert.ok(at(-40, 500)[0] < 0.2, "beside the fold");
  assert.equal(at(20, 491), null, "on the back of what is folded over");
});

test("lengths of a print whose size is not known are counted in its width, and its anchors are as steady", () => {
  const perMm = 1 / 200;
  const topology = { faces: Uint32Array.of(0, 2, 1), textureCoordinates: Float32Array.of(0, 0, 1, 0, 0, 1) };
  const raw = (z) => ({ vertices: Float32Array.of(-100, -50, z, 100, -50, z, -100, 50, z), confidence: new Float32Array(3), deviations: Float32Array.of(2, 4, 6) });
  const [inMm, inWidths] = [topology, { ...topology, perMm }].map((of) => ({ of, pose: new SurfacePose(of, 0.2, 0.2) }));
  const given = raw(400);
  const mesh = new SurfaceMesh(given, inWidths.of, "fit");
  assert.deepEqual([mesh.pointAt(0, 0), ...mesh.deviations].flat().map((x) => x.toFixed(4)), ["-0.5000", "-0.2500", "2.0000", "0.0100", "0.0200", "0.0300"]);
  assert.equal(given.vertices[2], 400, "the engine's own stay");
  assert.deepEqual([...scaledDepth(Float32Array.of(-1, 400), perMm)], [-1, 2]);
  for (let i = 0; i < 20; i++) {
    for (const { of, pose } of [inMm, inWidths]) pose.follow(new SurfaceMesh(raw(400 + 4 * i), of, "tracking"), 33 * i);
    inMm.pose.position.forEach((mm, k) => assert.ok(Math.abs(mm * perMm - inWidths.pose.position[k]) < 1e-5, `${i}`));
  }
});
