// The whole mesh of a picture, against the native program.

import assert from "node:assert/strict";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, PHONE, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { disagreement } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { nativeEstimates, unseenFrames } from "../support/native.mjs";

/** The training camera, which took the frames. */
const CAMERA = { width: 480, height: 270, fx: 380, fy: 380, cx: 240, cy: 135 };

/**
 * The fit starts from maps that differ by a relative 1e-3 (see camera.test.mjs) and stops when a step moves no vertex by
 * more than a thousandth of an edge (0.01 mm), along valleys in which the image says little.
 */
const SAME_MESH = { rmsMm: 0.5, maxMm: 10, medianPx: 0.1 };
// A fit multiplies rounding: the networks agree to a thousandth of a millimetre, fits of an uncertain frame to one or two.
const SAME_MAPS = { maskPixels: 130, depthMm: 3, registrationMm: 2 };

let folder;
let frames;
let browser;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-mesh-"));
    frames = await unseenFrames(folder, 4);
    browser = await launch();
  },
  { timeout: SLOW_MS },
);
after(async () => {
  await browser?.close();
  await rm(folder, { recursive: true, force: true });
});

test("completeMesh() and fit: true give what the native program gives", { timeout: SLOW_MS }, async (t) => {
  const demo = await openDemo(browser);
  const pictures = frames.map(({ name, png }) => ({ name, png: png.toString("base64") }));
  const answers = await demo.page.evaluate(
    async ([shown, camera]) => {
      const { DeepSft } = await import("./src/index.js");
      const sft = await DeepSft.load("models/poster-a4/", { device: "cpu" });
      // As a text: lists of so many numbers take seconds to hand over.
      const base64Of = (map) => {
        const bytes = new Uint8Array(map.toFloat32Array().buffer);
        let text = "";
        for (let at = 0; at < bytes.length; at += 32_768) text += String.fromCharCode(...bytes.subarray(at, at + 32_768));
        return btoa(text);
      };
      const all = [];
      for (const { png } of shown) {
        const blob = new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))]);
        const raw = await sft.estimate(blob, { camera });
        const [first, again] = await Promise.all([raw.completeMesh(), raw.completeMesh()]);
        const fitted = await sft.estimate(blob, { camera, fit: true });
        const whole = await fitted.completeMesh();
        const completed = await raw.completeMesh({ method: "completion" });
        all.push({
          found: raw.found,
          mesh: first && [...first.vertices],
          method: first && first.method,
          completed: completed && [...completed.vertices],
          completedMethod: completed && completed.method,
          recovered: completed && completed.confidence.filter((c) => c === 0).length,
          sameTwice: first?.vertices === again?.vertices,
          confidence: first && [...first.confidence],
          normalsTowardsCamera: first && first.normals.filter((n, i) => i % 3 === 2 && n < 0).length,
          sizes: first && [first.faces.length, first.textureCoordinates.length, sft.targets[0].mesh.faces.length],
          fitted: fitted.fitted,
          fitMs: fitted.times.fitMs,
          fittedMesh: whole && [...whole.vertices],
          depth: base64Of(fitted.depth),
          registration: base64Of(fitted.registration),
        });
        raw.close();
        fitted.close();
      }
      sft.close();
      return all;
    },
    [pictures, CAMERA],
  );
  const camera = { ...CAMERA, distortion: [0, 0, 0, 0, 0] };
  const native = await nativeEstimates(join(folder, "native"), frames, camera, "fit");
  const completions = await nativeEstimates(join(folder, "completion"), frames, camera, "complete");
  let meshes = 0;
  for (const [i, { name }] of frames.entries()) {
    const [answer, theirs] = [answers[i], native.get(name)];
    assert.equal(answer.found, theirs.found);
    assert.equal(answer.fitted, theirs.fitted, `frame ${name}: accepted by one only`);
    const [depth, registration] = [answer.depth, answer.registration].map((base64) => new Float32Array(new Uint8Array(Buffer.from(base64, "base64")).buffer));
    const apart = disagreement({ depth, registration }, theirs);
    for (const [figure, most] of Object.entries(SAME_MAPS))
      assert.ok(apart[figure] <= most, `frame ${name}: ${figure} ${apart[figure]}`);
    const completion = completions.get(name);
    assert.equal(answer.completed === null, !completion.mesh);
    if (completion.mesh) {
      assert.equal(answer.completedMethod, "completion");
      assert.ok(answer.recovered < answer.completed.length / 3, "some vertices are seen");
      const distance = meshDistance(answer.completed, completion.mesh);
      t.diagnostic(`frame ${name}: completed, ${JSON.stringify(distance)}`);
      for (const [figure, most] of Object.entries(SAME_MESH))
        assert.ok(distance[figure] <= most, `frame ${name}, completed: ${figure} ${distance[figure]}`);
    }
    if (!theirs.mesh) {
      assert.deepEqual(answer.mesh, answer.completed, "without a fit the completion stands in");
      continue;
    }
    assert.equal(answer.method, "fit");
    meshes++;
    const vertices = answer.mesh.length / 3;
    assert.equal(answer.confidence.length, vertices);
    assert.ok(answer.confidence.every((c) => c >= 0 && c <= 1) && answer.confidence.some((c) => c > 0.5));
    assert.deepEqual(answer.sizes, [answer.sizes[2], 2 * vertices, answer.sizes[2]]);
    assert.ok(answer.normalsTowardsCamera > vertices / 2, "the print faces the camera");
    assert.ok(answer.sameTwice);
    assert.ok(answer.fitMs > 0);
    const distance = meshDistance(answer.mesh, theirs.mesh);
    t.diagnostic(`frame ${name}: ${JSON.stringify(distance)}, ${answer.fitMs.toFixed(0)} ms`);
    for (const [figure, most] of Object.entries(SAME_MESH))
      assert.ok(distance[figure] <= most, `frame ${name}: ${figure} ${distance[figure]}`);
    assert.deepEqual(answer.fittedMesh, answer.mesh, "both ways give the same mesh");
  }
  assert.ok(meshes >= 2, `${meshes} meshes`);
  await demo.finish();
});

test("a picture without the poster has no mesh, and a closed estimate gives none", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser);
  const [nothing, closed] = await demo.page.evaluate(
    async (png) => {
      const { DeepSft } = await import("./src/index.js");
      const sft = await DeepSft.load("models/poster-a4/", { device: "cpu" });
      const grey = await sft.estimate(new ImageData(640, 480), { fit: true });
      const shown = await sft.estimate(new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))]));
      shown.close();
      const refusal = await shown.completeMesh().catch((error) => error.code);
      const answer = [[grey.fitted, await grey.completeMesh()], refusal];
      sft.close();
      return answer;
    },
    frames[0].png.toString("base64"),
  );
  assert.deepEqual(nothing, [false, null]);
  assert.equal(closed, "closed");
  await demo.finish();
});

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`an image is drawn with its mesh, on a ${name}`, { timeout: SLOW_MS }, async () => {
    const demo = await openDemo(browser, { device, query: "?device=cpu" });
    const { page } = demo;
    const [{ png }] = frames;
    await page.setInputFiles("#image-file", { name: "frame.png", mimeType: "image/png", buffer: png });
    await page.waitForSelector('#live[data-mesh="true"]');
    for (const overlay of ["object", "shaded", "mesh", "depth", "paper"]) {
      await page.click(`[value="${overlay}"]`);
      await page.waitForSelector(`[value="${overlay}"]:checked`);
      await demo.screenshot(`${name}-image-${overlay}`);
    }
    await demo.finish();
  });
}
