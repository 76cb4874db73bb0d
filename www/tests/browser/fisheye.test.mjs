// A fisheye through the whole package: estimates, tracking, the page's scene, the shaders' lens.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { median } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { onPage } from "../support/page.mjs";
import { seenByFisheye, throughFisheye } from "../support/pictures.mjs";
import { encodePng } from "../support/png.mjs";
import { y4m } from "../support/y4m.mjs";
import { distorted, undistorted } from "../../src/camera/lens.js";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_061;
const FRAMES = 3;
/** What lies 20 degrees off its axis is 16 pixels nearer to the middle than a pinhole of this focal length would have it. */
const CAMERA = { width: 960, height: 540, fx: 700, fy: 704, cx: 470, cy: 280, fisheye: [-0.06, 0.02, -0.004, 0.001] };
/** A mesh that was fitted to the image against the truth: that of a pinhole's image is as good. */
const MOST = { medianPx: 0.4, rmsMm: 4 };
/** Places in the image, as the package tells them, against the definition of the fisheye. */
const MAX_IN_IMAGE_PX = 1;
/** A hundredth of a pixel where the focal length is 700 pixels. */
const MAX_IN_SHADERS = 1.4e-5;
/** Of what is drawn and of the true sheet in the image: intersection over union. */
const MIN_OVERLAP = 0.97;

let folder;
let frames;
let cameraFile;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-fisheye-"));
  const clip = await makeClip({ event: "still", frames: FRAMES, seed: SEED, scale: 2 });
  frames = clip.frames.map(({ picture, vertices }) => ({ picture: throughFisheye(picture, clip.camera, CAMERA), vertices }));
  cameraFile = join(folder, "camera.y4m");
  await writeFile(cameraFile, y4m(frames.map(({ picture }) => picture), 10));
}, { timeout: SLOW_MS });
after(() => rm(folder, { recursive: true, force: true }));

const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** How far the mesh is from the truth, in space and, as the package sees it in the image, in pixels. */
function check(t, what, { vertices, points }, truth) {
  const distance = meshDistance(vertices, truth);
  const expected = seenByFisheye(vertices, CAMERA);
  const inImage = Math.max(...expected.map((place, i) => apart(place, points.slice(2 * i, 2 * i + 2))));
  const off = median(seenByFisheye(truth, CAMERA).map((place, i) => apart(place, points.slice(2 * i, 2 * i + 2))));
  t.diagnostic(`${what}: ${JSON.stringify(distance)}, ${off} px in the image, projected to ${inImage} px`);
  for (const [figure, most] of Object.entries(MOST)) assert.ok(distance[figure] <= most, `${what}: ${figure} ${distance[figure]}`);
  assert.ok(inImage < 0.01, `${what}: ${inImage} px`);
  assert.ok(off < MAX_IN_IMAGE_PX, `${what}: ${off} px`);
}

test("an image of a fisheye is measured, and what the page draws lies on the sheet", { timeout: SLOW_MS }, async (t) => {
  const browser = await launch({ webgpu: false });
  try {
    // The page's own modules want its import map.
    const demo = await openDemo(browser);
    const [{ picture, vertices: truth }] = frames;
    const seen = await demo.page.evaluate(async ([png, camera, truth]) => {
      const [deepsft, { start }, { Overlays }] = await Promise.all([import("deepsft"), import("deepsft/scene"), import("/demo/live/overlays.js")]);
      const blob = new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))]);
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const [target] = sft.targets;
      const estimate = await sft.estimate(blob, { camera });
      const mesh = await estimate.completeMesh();
      // The picture fills the scene.
      const { width, height } = camera;
      const place = document.createElement("div");
      place.style.cssText = `position: absolute; left: 0; top: 0; width: ${width}px; height: ${height}px`;
      document.body.append(place);
      const view = await start(place, { sft, photograph: blob, camera, screens: false });
      await new Promise((resolve) => view.addEventListener("found", resolve));
      const overlays = new Overlays(view, target, place, new AbortController().signal);
      const pen = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
      const draw = async (overlay) => {
        overlays.show({ overlay, paper: "aurora", object: "house" });
        overlays.follow(mesh, { near: 100, far: 1500, step: 100 });
        pen.drawImage(await createImageBitmap(await view.shot()), 0, 0, width, height);
        return pen.getImageData(0, 0, width, height).data;
      };
      // The true sheet as a pinhole sees it, which is what a scene shows: its triangles, filled.
      const sheet = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
      sheet.beginPath();
      const { faces } = target.mesh;
      for (let i = 0; i < faces.length; i += 3) {
        const corners = [...faces.subarray(i, i + 3)].map((v) => [(camera.fx * truth[v][0]) / truth[v][2] + camera.cx, (camera.fy * truth[v][1]) / truth[v][2] + camera.cy]);
        // All one way round, or they would cancel out where they meet.
        const [[ax, ay], [bx, by], [cx, cy]] = corners;
        if ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0) corners.reverse();
        corners.forEach(([x, y], k) => (k === 0 ? sheet.moveTo(x, y) : sheet.lineTo(x, y)));
        sheet.closePath();
      }
      sheet.fill("nonzero");
      const inSheet = sheet.getImageData(0, 0, width, height).data;
      const plain = await draw("plain");
      const overlaps = {};
      for (const overlay of ["shaded", "depth"]) {
        const drawn = await draw(overlay);
        let [both, either] = [0, 0];
        for (let i = 0; i < drawn.length; i += 4) {
          const isDrawn = [0, 1, 2].some((k) => Math.abs(drawn[i + k] - plain[i + k]) > 2);
          const isSheet = inSheet[i + 3] > 127;
          both += isDrawn && isSheet;
          either += isDrawn || isSheet;
        }
        overlaps[overlay] = both / either;
      }
      const result = { found: estimate.found, vertices: [...mesh.vertices], points: [...deepsft.verticesInImage(mesh.vertices, estimate.camera)], overlaps };
      estimate.close();
      view.close();
      sft.close();
      return result;
    }, [encodePng({ ...picture, values: picture.rgb }).toString("base64"), CAMERA, Array.from({ length: truth.length / 3 }, (_, i) => [...truth.slice(3 * i, 3 * i + 3)])]);
    assert.ok(seen.found);
    check(t, "estimate", seen, truth);
    t.diagnostic(JSON.stringify(seen.overlaps));
    for (const [name, overlap] of Object.entries(seen.overlaps)) assert.ok(overlap > MIN_OVERLAP, `${name}: ${overlap}`);
    await demo.finish();
  } finally {
    await browser.close();
  }
});

test("a sheet is followed through a fisheye", { timeout: SLOW_MS }, (t) =>
  onPage({ webgpu: false, camera: cameraFile, permissions: ["camera"] }, async ({ page }) => {
    const seen = await page.evaluate(async (camera) => {
      const video = document.createElement("video");
      document.body.append(video);
      const stream = await deepsft.openCamera(video);
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const meshes = [];
      for await (const { mesh, camera: of } of sft.follow(stream, { camera })) {
        if (mesh) meshes.push({ vertices: [...mesh.vertices], points: [...deepsft.verticesInImage(mesh.vertices, of)], of });
        if (meshes.length === 12) break;
      }
      stream.close();
      sft.close();
      return meshes.at(-1);
    }, CAMERA);
    assert.deepEqual([seen.of.width, seen.of.height, seen.of.fisheye], [CAMERA.width, CAMERA.height, CAMERA.fisheye]);
    check(t, "tracked", seen, frames[0].vertices);
  }),
);

test("shaders bend rays as the package does, there and back", { timeout: SLOW_MS }, () =>
  onPage({ webgpu: false }, async ({ page }) => {
    const lenses = [
      { fisheye: [0.02, -0.01, 0.004, -0.0012] },
      { distortion: [-0.3, 0.11, 0.0008, -0.0006, -0.01] },
      { distortion: [0.12, -0.05, -0.002, 0.001, 0] },
      // Folds back at a ray of length 1.05.
      { distortion: [-0.3, 0, 0, 0, 0] },
      {},
    ];
    const side = 24;
    const rayOf = (i) => [((i % side) / (side - 1) - 0.5) * 2.2, (Math.floor(i / side) / (side - 1) - 0.5) * 1.8];
    const drawn = await page.evaluate(([lenses, rays, side]) => {
      const gl = new OffscreenCanvas(1, 1).getContext("webgl2");
      if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no float buffers");
      const shader = (type, source) => {
        const made = gl.createShader(type);
        gl.shaderSource(made, `#version 300 es\nprecision highp float;${source}`);
        gl.compileShader(made);
        if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
        return made;
      };
      const program = gl.createProgram();
      gl.attachShader(program, shader(gl.VERTEX_SHADER, "void main() { gl_Position = vec4(vec2[3](vec2(-1), vec2(3, -1), vec2(-1, 3))[gl_VertexID], 0, 1); }"));
      gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `uniform sampler2D u_rays; out vec4 o; ${deepsft.LENS_GLSL}
        void main() { vec2 ray = texelFetch(u_rays, ivec2(gl_FragCoord.xy), 0).xy; vec2 place = distorted(ray); o = vec4(place, undistorted(place)); }`));
      gl.linkProgram(program);
      gl.useProgram(program);
      const texture = (values) => {
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, side, side, 0, gl.RGBA, gl.FLOAT, values);
        for (const name of ["MIN_FILTER", "MAG_FILTER"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl.NEAREST);
        return gl.getParameter(gl.TEXTURE_BINDING_2D);
      };
      gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture(null), 0);
      texture(new Float32Array(rays.flatMap((ray) => [...ray, 0, 0])));
      gl.viewport(0, 0, side, side);
      return lenses.map((lens) => {
        gl.uniform1fv(gl.getUniformLocation(program, "u_lens"), deepsft.lensUniform(lens));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        const values = new Float32Array(4 * side * side);
        gl.readPixels(0, 0, side, side, gl.RGBA, gl.FLOAT, values);
        return [...values];
      });
    }, [lenses, Array.from({ length: side * side }, (_, i) => rayOf(i)), side]);
    for (const [k, lens] of lenses.entries()) {
      let [there, back] = [0, 0];
      for (let i = 0; i < side * side; i++) {
        const [x, y, ...ray] = drawn[k].slice(4 * i, 4 * i + 4);
        const place = distorted(lens, ...rayOf(i));
        there = Math.max(there, apart([x, y], place));
        // Beyond the fold only the outermost ray is left.
        back = Math.max(back, apart(distorted(lens, ...ray), distorted(lens, ...undistorted(lens, ...place))));
      }
      assert.ok(there < MAX_IN_SHADERS && back < MAX_IN_SHADERS, `${JSON.stringify(lens)}: ${there}, ${back} back`);
    }
  }),
);
