// `deepsft/three` against our own camera model and meshes whose poses are known.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { Matrix4, PerspectiveCamera, Quaternion, Raycaster, Vector2, Vector3 } from "three";

import { SurfaceMesh, verticesInImage } from "deepsft";
import { FrameBackground, FrameCamera, Sheet, SurfaceGeometry, turnedFrame } from "deepsft/three";
import { noise } from "./support.mjs";

const INTRINSICS = { width: 1280, height: 720, fx: 1010, fy: 1023, cx: 655.5, cy: 341.25 };
const near = (actual, expected, tolerance, what = "") =>
  assert.ok(Math.abs(actual - expected) <= tolerance, `${what} ${actual} is not ${expected}`);

/** A sheet of 200 x 100 mm on a grid, as `bent` lays it in the camera's frame. */
function sheetMesh(bent = (x, y) => [x, y, 400], columns = 9, rows = 5) {
  const [vertices, uv, faces] = [[], [], []];
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < columns; i++) {
      const [u, v] = [i / (columns - 1), j / (rows - 1)];
      uv.push(u, v);
      vertices.push(...bent(200 * (u - 0.5), 100 * (v - 0.5)));
      const [a, b, c, d] = [0, 1, columns, columns + 1].map((step) => j * columns + i + step);
      if (i + 1 < columns && j + 1 < rows) faces.push(a, c, b, b, c, d);
    }
  }
  const topology = { faces: Uint32Array.from(faces), textureCoordinates: Float32Array.from(uv) };
  const raw = { vertices: Float32Array.from(vertices), confidence: new Float32Array(uv.length / 2).fill(1) };
  return { topology, mesh: new SurfaceMesh(raw, topology, "tracking") };
}

function targetOf(topology) {
  const texture = { data: new Uint8ClampedArray(4 * 16 * 8).fill(255), width: 16, height: 8 };
  return { name: "print", mesh: topology, texture, widthMm: 200, heightMm: 100 };
}

const trackedOf = (target, mesh) => ({
  of: (asked) => (asked === target ? { target, found: mesh !== null, mesh, correlation: 1 } : undefined),
  frame: null,
  camera: INTRINSICS,
});

for (const [name, canvas] of [
  ["of the image's shape", { width: 640, height: 360 }],
  ["that is wider", { width: 900, height: 300 }],
  ["that is upright", { width: 390, height: 844 }],
]) {
  for (const fit of ["cover", "contain", 1.12]) {
    test(`on a canvas ${name}, ${fit}, a point is drawn where our camera model sees it`, () => {
      const camera = new FrameCamera({ fit });
      camera.setIntrinsics(INTRINSICS, canvas);
      // As CSS defines object-fit, with the image in the middle.
      const scales = [canvas.width / INTRINSICS.width, canvas.height / INTRINSICS.height];
      const most = { cover: Infinity, contain: 1 }[fit] ?? fit;
      const scale = Math.min(Math.max(...scales), most * Math.min(...scales));
      const random = noise(7);
      for (let i = 0; i < 100; i++) {
        const point = [300 * random(), 300 * random(), 600 + 500 * random()];
        const [x, y] = [
          (INTRINSICS.fx * point[0]) / point[2] + INTRINSICS.cx,
          (INTRINSICS.fy * point[1]) / point[2] + INTRINSICS.cy,
        ];
        const ndc = new Vector3(point[0], -point[1], -point[2]).project(camera);
        near(((ndc.x + 1) / 2) * canvas.width, (x - INTRINSICS.width / 2) * scale + canvas.width / 2, 1e-9, "x");
        near(((1 - ndc.y) / 2) * canvas.height, (y - INTRINSICS.height / 2) * scale + canvas.height / 2, 1e-9, "y");
        assert.ok(ndc.z > -1 && ndc.z < 1);
      }
    });
  }
}

test("a camera that looks at a part of the image draws there what it drew before", () => {
  const camera = new FrameCamera();
  camera.setIntrinsics(INTRINSICS, { width: 1280, height: 720 });
  const [whole, part] = [camera.region, { left: 300, top: 120, right: 700, bottom: 320 }];
  const places = [[-40, 60, 700], [10, -35, 420], [-90, -20, 900]].map((point) => {
    const seen = () => new Vector3(point[0], -point[1], -point[2]).project(camera);
    camera.lookAtRegion(whole);
    const { x, y } = seen();
    camera.lookAtRegion(part);
    const inPart = seen();
    near(part.left + ((inPart.x + 1) / 2) * 400, ((x + 1) / 2) * 1280, 1e-9);
    near(part.top + ((1 - inPart.y) / 2) * 200, ((1 - y) / 2) * 720, 1e-9);
    return inPart;
  });
  assert.ok(places.some(({ x }) => Math.abs(x) < 1));
  near(camera.aspect, (400 * INTRINSICS.fy) / (200 * INTRINSICS.fx), 1e-12);
});

test("near and far are millimetres, and the projection is inverted with them", () => {
  const camera = new FrameCamera({ near: 50, far: 2000 });
  camera.setIntrinsics(INTRINSICS, { width: 640, height: 360 });
  near(new Vector3(0, 0, -50).project(camera).z, -1, 1e-9);
  near(new Vector3(0, 0, -2000).project(camera).z, 1, 1e-9);
  const identity = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.projectionMatrixInverse);
  identity.elements.forEach((value, i) => near(value, i % 5 === 0 ? 1 : 0, 1e-9));
});

test("the geometry follows a mesh in place, in the frame of three.js, with the mesh's own normals", () => {
  const { topology, mesh } = sheetMesh((x, y) => [x, y, 400 + 0.002 * x * x + 0.3 * y]);
  const geometry = new SurfaceGeometry(topology);
  const arrays = () => ["position", "normal", "uv"].map((name) => geometry.getAttribute(name).array);
  const [before, versions] = [arrays(), ["position", "normal"].map((name) => geometry.getAttribute(name).version)];
  geometry.update(mesh);
  arrays().forEach((array, i) => assert.equal(array, before[i]));
  ["position", "normal"].forEach((name, i) => assert.ok(geometry.getAttribute(name).version > versions[i], name));
  assert.equal(geometry.index.array, topology.faces);
  const [position, normal, uv] = arrays();
  for (let i = 0; i < mesh.vertices.length; i += 3) {
    assert.deepEqual([...position.slice(i, i + 3)], [mesh.vertices[i], -mesh.vertices[i + 1], -mesh.vertices[i + 2]]);
    for (const [k, sign] of [1, -1, -1].entries()) near(normal[i + k], sign * mesh.normals[i + k], 1e-6);
    // Towards the camera, which looks along -z.
    assert.ok(normal[i + 2] > 0.5);
  }
  assert.deepEqual([...uv.slice(0, 2)], [0, 1], "the print's top left is the texture's");
  // Again, elsewhere: nothing of the last frame stays.
  const moved = sheetMesh((x, y) => [x + 10, y, 500]).mesh;
  geometry.update(moved);
  near(position[2], -500, 0);
  [0, 0, 1].forEach((value, k) => near(normal[k], value, 1e-6));
  near(geometry.boundingSphere.center.x, 10, 1e-3);
  assert.throws(() => geometry.update(sheetMesh(undefined, 4, 4).mesh), { code: "invalid-argument" });
});

test("an anchor stands upright on a flat sheet: x along u, y its normal, z down the print", () => {
  const { topology, mesh } = sheetMesh();
  const target = targetOf(topology);
  const sheet = new Sheet(target);
  const anchor = sheet.anchor(0.3, 0.8, { smooth: false });
  assert.deepEqual([sheet.visible, anchor.visible, anchor.parent === sheet], [false, false, true]);
  sheet.update(trackedOf(target, mesh), 0);
  assert.deepEqual([sheet.visible, anchor.visible], [true, true]);
  // u = 0.3 lies 40 mm left of the middle, v = 0.8 lies 30 mm below it.
  [-40, -30, -400].forEach((value, k) => near(anchor.position.getComponent(k), value, 1e-4));
  const axis = (x, y, z) => new Vector3(x, y, z).applyQuaternion(anchor.quaternion).toArray();
  for (const [given, expected] of [[[1, 0, 0], [1, 0, 0]], [[0, 1, 0], [0, 0, 1]], [[0, 0, 1], [0, -1, 0]]])
    axis(...given).forEach((value, k) => near(value, expected[k], 1e-5));
});

test("on a cylinder an anchor has the surface's true pose at every place, also on its borders", () => {
  const radius = 80;
  // Around a vertical axis behind the sheet: u is the arc, and the print looks outwards, at the camera.
  const at = (x, y) => [radius * Math.sin(x / radius), y, 500 - radius * Math.cos(x / radius)];
  const { topology, mesh } = sheetMesh(at, 65, 9);
  const target = targetOf(topology);
  const sheet = new Sheet(target);
  const anchor = sheet.anchor(0, 0, { smooth: false });
  for (const [u, v] of [[0, 0], [1, 1], [0.5, 0.5], [0.21, 0.77], [0.93, 0.02]]) {
    anchor.place(u, v);
    sheet.update(trackedOf(target, mesh), 0);
    const [x, y] = [200 * (u - 0.5), 100 * (v - 0.5)];
    const place = turnedFrame(Float32Array.from(at(x, y)));
    // A chord of 3 mm stays 0.015 mm below its arc.
    assert.ok(anchor.position.distanceTo(new Vector3(...place)) < 0.03, `${u}, ${v}: ${anchor.position.toArray()}`);
    const angle = x / radius;
    const expected = new Matrix4().makeBasis(
      new Vector3(Math.cos(angle), 0, -Math.sin(angle)),
      new Vector3(Math.sin(angle), 0, Math.cos(angle)),
      new Vector3(0, -1, 0),
    );
    const turned = anchor.quaternion.angleTo(new Quaternion().setFromRotationMatrix(expected));
    // At a border the normal is the mean of faces on one side alone: half a face off, 1.1 degrees.
    assert.ok(turned < (1.2 * Math.PI) / 180, `${u}, ${v}: ${turned}`);
  }
  assert.throws(() => anchor.place(1.2, 0.5), { code: "invalid-argument" });
});

test("while the target is lost the sheet and what stands on it are hidden; found again it does not glide in", () => {
  const { topology, mesh } = sheetMesh();
  const away = sheetMesh((x, y) => [x + 5, y, 400]).mesh;
  const target = targetOf(topology);
  const sheet = new Sheet(target);
  const anchor = sheet.anchor(0.5, 0.5);
  sheet.update(trackedOf(target, mesh), 0);
  sheet.update(trackedOf(target, null), 30);
  assert.deepEqual([sheet.visible, anchor.visible], [false, false]);
  sheet.update(trackedOf(target, away), 60);
  assert.deepEqual([sheet.visible, anchor.visible], [true, true]);
  near(anchor.position.x, 5, 1e-3);
  sheet.update(trackedOf({}, away), 90);
  assert.equal(sheet.visible, false, "a frame in which the target is not followed");
});

test("a smooth anchor trembles less than half as much as its sheet, and lags little behind one that moves", () => {
  const { topology } = sheetMesh();
  const target = targetOf(topology);
  const run = (placeAt) => {
    const sheet = new Sheet(target);
    const anchor = sheet.anchor(0.5, 0.5);
    return Array.from({ length: 120 }, (_, i) => {
      const x = placeAt(i);
      sheet.update(trackedOf(target, sheetMesh((a, b) => [a + x, b, 400]).mesh), (1000 * i) / 30);
      return anchor.position.x - x;
    });
  };
  const random = noise(3);
  const jitter = Array.from({ length: 120 }, () => 0.5 * random());
  const rms = (values) => Math.sqrt(values.reduce((sum, x) => sum + x * x, 0) / values.length);
  const off = run((i) => jitter[i]).map((error, i) => error + jitter[i]);
  const ratio = rms(off.slice(30)) / rms(jitter.slice(30));
  assert.ok(ratio < 0.5 && ratio > 0.05, `${ratio}`);
  // 150 mm/s: a cut-off of 17 Hz, a lag of a third of a frame.
  const lag = Math.max(...run((i) => 5 * i).slice(30).map(Math.abs));
  assert.ok(lag < 2 && lag > 0, `${lag} mm`);
});

test("a sheet is hit by rays on both sides, the frame by none", () => {
  const { topology, mesh } = sheetMesh();
  const target = targetOf(topology);
  const sheet = new Sheet(target);
  sheet.update(trackedOf(target, mesh), 0);
  const background = new FrameBackground();
  const camera = new FrameCamera();
  camera.setIntrinsics(INTRINSICS, { width: 640, height: 360 });
  const [x, y] = verticesInImage(Float32Array.of(50, 25, 400), INTRINSICS);
  const rays = new Raycaster();
  rays.setFromCamera(new Vector2((2 * x) / 1280 - 1, 1 - (2 * y) / 720), camera);
  const [hit, ...others] = rays.intersectObjects([background, sheet]);
  assert.equal(others.length, 0);
  near(hit.distance, Math.hypot(50, 25, 400), 1e-2);
  near(hit.uv.x, 0.75, 1e-4);
  near(1 - hit.uv.y, 0.75, 1e-4);
  sheet.dispose();
});

test("the background closes a frame when the next one is shown, and the last when it is let go", () => {
  const background = new FrameBackground();
  const closed = [];
  const tracked = (name) => ({ frame: { width: 640, height: 360 }, close: () => closed.push(name) });
  const [first, second] = [tracked("first"), tracked("second")];
  background.show(first);
  background.show(first);
  assert.deepEqual([closed, background.visible], [[], true]);
  background.show(second);
  assert.deepEqual(closed, ["first"]);
  background.dispose();
  assert.deepEqual([closed, background.visible], [["first", "second"], false]);
});

test("the background draws nothing through a camera that is none of ours, and says so once", (t) => {
  const said = t.mock.method(console, "warn", () => undefined);
  const background = new FrameBackground();
  background.show({ frame: { width: 1280, height: 720 } });
  const seen = (camera) => {
    background.onBeforeRender(null, null, camera);
    const { u_region, u_camera } = background.material.uniforms;
    return [...u_region.value.toArray(), u_camera.value.x];
  };
  const camera = new FrameCamera();
  const isBeyond = (region) => region.slice(0, 4).every((x) => x < 0) && region[4] !== 0;
  assert.ok(isBeyond(seen(camera)), "no frame was told yet");
  assert.equal(said.mock.callCount(), 0);
  camera.setIntrinsics(INTRINSICS, { width: 640, height: 360 });
  assert.deepEqual(seen(camera), [0, 0, 1280, 720, INTRINSICS.fx]);
  for (let i = 0; i < 2; i++) assert.ok(isBeyond(seen(new PerspectiveCamera())));
  assert.equal(said.mock.callCount(), 1);
  assert.deepEqual(seen(camera).slice(0, 4), [0, 0, 1280, 720]);
});

test("an anchor that was removed from its sheet is posed no more", () => {
  const { topology, mesh } = sheetMesh();
  const target = targetOf(topology);
  const sheet = new Sheet(target);
  const anchor = sheet.anchor(0.5, 0.5);
  sheet.remove(anchor);
  sheet.update(trackedOf(target, mesh), 0);
  assert.equal(anchor.visible, false);
});

test("what covered the print when it was lost does not cover it when it is found again", (t) => {
  // The light is read from a small copy of the frame.
  globalThis.OffscreenCanvas = class {
    getContext = () => ({ canvas: this, drawImage: () => undefined, getImageData: (x, y, width, height) => ({ data: new Uint8ClampedArray(4 * width * height).fill(200), width, height }) });
  };
  t.after(() => delete globalThis.OffscreenCanvas);
  const { topology, mesh } = sheetMesh();
  const target = targetOf(topology);
  const { data } = target.texture;
  for (let i = 0; i < data.length; i += 8) data.fill(0, i, i + 3);
  const sheet = new Sheet(target, { map: {} });
  const covered = Object.assign(Object.create(mesh), { confidence: mesh.confidence.map(() => 0) });
  const frame = { width: 1280, height: 720 };
  const shown = (seen, correlation) => {
    sheet.update({ of: () => ({ target, mesh: seen, correlation }), frame, camera: INTRINSICS }, 0);
    return sheet.geometry.getAttribute("color").getW(20);
  };
  for (let i = 0; i < 8; i++) shown(covered, 0.9);
  assert.equal(shown(covered, 0.9), 0);
  shown(null, 0);
  assert.equal(shown(mesh, 0.5), 1);
});

/** All modules that a module of the package loads, itself included, and what else it asks for by name. */
function loadedBy(file) {
  const [files, names, left] = [new Set(), new Set(), [file]];
  for (const path of left) {
    if (files.has(path) || !existsSync(path)) continue;
    files.add(path);
    // Comments name types of three.js.
    const code = readFileSync(path, "utf8").replace(/\/\*[^]*?\*\//g, "");
    for (const [, name] of code.matchAll(/^(?:import|export)\b(?:[^;"]*? from)? "([^"]+)"/gm))
      name.startsWith(".") ? left.push(join(dirname(path), name)) : names.add(name);
  }
  return { files: files.size, names: [...names] };
}

test("a new three.js, which comes each month, does not break the installation", () => {
  const { peerDependencies } = JSON.parse(readFileSync(new URL("../../package.json", import.meta.url), "utf8"));
  assert.match(peerDependencies.three, /^>=[\d.]+$/);
});

test("only deepsft/three needs three.js, and nothing needs a page to be imported", () => {
  // That Node.js, which has none of these, has imported all of it is the other half of the proof.
  for (const name of ["document", "window", "Worker"]) assert.equal(typeof globalThis[name], "undefined");
  const src = fileURLToPath(new URL("../../src/", import.meta.url));
  for (const [entry, names] of [["index.js", []], ["light/index.js", []], ["worker.js", []], ["three/index.js", ["three"]]]) {
    const loaded = loadedBy(join(src, entry));
    assert.ok(loaded.files >= 4, `${entry} loads ${loaded.files} files`);
    assert.deepEqual(loaded.names, names, entry);
  }
});
