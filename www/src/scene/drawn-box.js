// The box in which something of a scene is drawn.

import { Box3, Vector3 } from "three";
import { SurfaceGeometry } from "../three/surface-geometry.js";

/** @import { BufferGeometry, Object3D } from "three" */
/** @import { FrameCamera, Region } from "../three/frame-camera.js" */

/** On the page, CSS pixels. @typedef {{ left: number, top: number, width: number, height: number }} Box */

/**
 * The part of an image that a box on the page shows.
 *
 * @param {Box} box
 * @param {Region} region that the whole page shows
 * @param {{ width: number }} page
 * @returns {Region}
 */
export function regionOf(box, region, page) {
  const scale = (region.right - region.left) / page.width;
  const [left, top] = [region.left + box.left * scale, region.top + box.top * scale];
  return { left, top, right: left + box.width * scale, bottom: top + box.height * scale };
}

/**
 * Where anything of a scene is drawn.
 *
 * @param {Object3D} scene whose matrices are those of now
 * @param {FrameCamera} camera
 * @returns {Box3} in clip space; it reaches everywhere where something lies beside the eye
 */
export function extentOf(scene, camera) {
  const seen = new Box3();
  const point = new Vector3();
  scene.traverseVisible((object) => {
    if (!isDrawn(object)) return;
    const add = () => {
      point.applyMatrix4(object.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
      // What lies beside the eye or behind it is anywhere.
      if (point.z > -camera.near) return void [-1, 1].forEach((far) => seen.expandByPoint(point.setScalar(far)));
      seen.expandByPoint(point.applyMatrix4(camera.projectionMatrix));
    };
    const geometry = /** @type {BufferGeometry} */ (/** @type {{ geometry?: unknown }} */ (object).geometry);
    if (geometry instanceof SurfaceGeometry) {
      const positions = geometry.getAttribute("position");
      for (let i = 0; i < positions.count; i++) {
        point.fromBufferAttribute(positions, i);
        add();
      }
      return;
    }
    // Of others the corners of their box. Bones and instances move.
    const moving = "computeBoundingBox" in object ? /** @type {import("three").InstancedMesh} */ (object) : null;
    if (moving ?? !geometry.boundingBox) (moving ?? geometry).computeBoundingBox();
    const box = /** @type {Box3} */ ((moving ?? geometry).boundingBox);
    if (box.isEmpty()) return;
    const { min, max } = box;
    for (let i = 0; i < 8; i++) {
      point.set(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
      add();
    }
  });
  return seen;
}

/** Whether it leaves anything in the picture. @param {Object3D} object */
function isDrawn(object) {
  if (!["isMesh", "isLine", "isPoints", "isSprite"].some((kind) => kind in object)) return false;
  const materials = [/** @type {import("three").Mesh} */ (object).material].flat();
  return materials.some(({ visible, colorWrite }) => visible && colorWrite);
}
