import assert from "node:assert/strict";
import { test } from "node:test";
import { BoxGeometry, Group, InstancedMesh, Matrix4, Mesh, MeshBasicMaterial, Scene } from "three";

import { FrameCamera } from "deepsft/three";
import { extentOf, regionOf } from "../../src/scene/drawn-box.js";

const INTRINSICS = { width: 640, height: 360, fx: 500, fy: 500, cx: 320, cy: 180 };
const camera = new FrameCamera();
camera.setIntrinsics(INTRINSICS, { width: 640, height: 360 });

/** Left, right, top and bottom of what is drawn of some objects, image pixels. */
function drawn(...objects) {
  const scene = new Scene();
  scene.add(...objects);
  scene.updateMatrixWorld();
  const { min, max } = extentOf(scene, camera);
  return [(min.x + 1) * 320, (max.x + 1) * 320, (1 - max.y) * 180, (1 - min.y) * 180].map((pixel) => Math.round(pixel));
}

/** A plate of 100 mm, 500 mm away: a millimetre is a pixel. */
function plate(x, y, material = new MeshBasicMaterial()) {
  const mesh = new Mesh(new BoxGeometry(100, 100, 0), material);
  mesh.position.set(x, y, -500);
  return mesh;
}

test("the box holds what is drawn, however it is nested and moved", () => {
  assert.deepEqual(drawn(plate(0, 0)), [270, 370, 130, 230]);
  const group = new Group();
  group.position.set(100, 50, 0);
  group.add(plate(0, 0));
  assert.deepEqual(drawn(plate(-100, 0), group), [170, 470, 80, 230]);
});

test("what is not seen does not count: neither invisible parts nor those that only hide others", () => {
  const invisible = new Group();
  invisible.visible = false;
  invisible.add(plate(200, 0));
  assert.deepEqual(drawn(plate(0, 0), invisible, plate(-200, 0, new MeshBasicMaterial({ colorWrite: false }))), [270, 370, 130, 230]);
});

test("instances count where they are now", () => {
  const instances = new InstancedMesh(new BoxGeometry(100, 100, 0), new MeshBasicMaterial(), 2);
  const place = (i, x) => instances.setMatrixAt(i, new Matrix4().makeTranslation(x, 0, -500));
  place(0, -100);
  place(1, 0);
  assert.deepEqual(drawn(instances), [170, 370, 130, 230]);
  place(1, 150);
  assert.deepEqual(drawn(instances), [170, 520, 130, 230]);
});

test("something beside the eye may be anywhere", () => {
  const mesh = plate(0, 0);
  mesh.position.z = 0;
  assert.deepEqual(drawn(mesh), [0, 640, 0, 360]);
});

test("a box on the page shows its part of the image", () => {
  const region = { left: -100, top: 0, right: 900, bottom: 500 };
  assert.deepEqual(regionOf({ left: 50, top: 20, width: 100, height: 60 }, region, { width: 500 }), { left: 0, top: 40, right: 200, bottom: 160 });
});
