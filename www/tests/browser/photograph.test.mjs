// Photographs whose files tell of their camera: the same in a browser and in the native program.

import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, SLOW_MS, launch, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { MODEL, deepsft } from "../support/native.mjs";
import { onPage } from "../support/page.mjs";
import { photograph } from "../support/photograph.mjs";
import { cut } from "../support/pictures.mjs";

/** Clips have seeds from 9,000,000 on; this is the tests' own. */
const SEED = 9_700_051;
/** The middle of the clip's frame, so that the typical phone's focal length, 632 px, is 17 % off the true one, 760 px. */
const SIZE = { width: 800, height: 450 };
/** 36 mm on the diagonal of 43.2666 mm, of 917.88 px: the true focal length is 35.83 mm. */
const EQUIVALENT_MM = 36;
const FOCAL = 763.72;
/** Of the depth of a mesh that was fitted to the image, as a fraction: half a per cent are the focal length's. */
const MAX_ERROR = 0.02;

const TEXTURE = join(MODEL, "template", "texture.png");
/** Of the poster's print. */
const WIDTH_MM = 297;

let folder;
let clip;
let picture;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "deepsft-photograph-"));
  clip = await makeClip({ event: "still", frames: 1, seed: SEED, scale: 2 });
  picture = cut(clip.frames[0].picture, SIZE);
}, { timeout: SLOW_MS });
after(() => rm(folder, { recursive: true, force: true }));

const meanDepth = (vertices) => vertices.reduce((sum, value, i) => (i % 3 === 2 ? sum + value : sum), 0) / (vertices.length / 3);

test("a photograph is measured with the camera of its EXIF data, turned or not, as the native program does", { timeout: SLOW_MS }, (t) =>
  onPage({ webgpu: false }, async ({ page }) => {
    const files = {
      plain: await photograph(page, picture),
      straight: await photograph(page, picture, { equivalentMm: EQUIVALENT_MM }),
      turned: await photograph(page, picture, { equivalentMm: EQUIVALENT_MM, orientation: 6 }),
    };
    const paths = Object.keys(files).map((name) => join(folder, `${name}.jpg`));
    await Promise.all(Object.values(files).map((bytes, i) => writeFile(paths[i], bytes)));
    await deepsft("reconstruct", "--model", MODEL, "--mesh", "complete", "--out", join(folder, "native"), ...paths);
    await deepsft("reconstruct", "--picture", TEXTURE, "--size-mm", String(WIDTH_MM), "--out", join(folder, "told"), paths[0]);
    const seen = await page.evaluate(async ({ widthMm, ...files }) => {
      const sft = await deepsft.DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const seen = {};
      for (const [name, base64] of Object.entries(files)) {
        const blob = new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]);
        const estimate = await sft.estimate(blob);
        const mesh = await estimate.completeMesh();
        seen[name] = { camera: estimate.camera, found: estimate.found, columns: estimate.depth.width, vertices: [...mesh.vertices] };
        estimate.close();
      }
      // What a program knows better goes before.
      const straight = new Blob([Uint8Array.from(atob(files.straight), (c) => c.charCodeAt(0))]);
      const given = await sft.estimate(straight, { camera: deepsft.estimatedCamera });
      seen.given = { camera: given.camera };
      given.close();
      const target = await sft.addPicture("/models/poster-a4/template/texture.png", { widthMm });
      const plain = new Blob([Uint8Array.from(atob(files.plain), (c) => c.charCodeAt(0))]);
      const told = await sft.estimate(plain, { target });
      seen.told = { camera: told.camera, vertices: [...(await told.completeMesh()).vertices] };
      told.close();
      sft.close();
      return seen;
    }, Object.fromEntries(Object.entries(files).map(([name, bytes]) => [name, bytes.toString("base64")]).concat([["widthMm", WIDTH_MM]])));
    const truth = meanDepth(clip.frames[0].vertices);
    for (const [name, source, focal] of [["plain", "estimated", 632], ["straight", "exif", FOCAL], ["turned", "exif", FOCAL]]) {
      const { camera, found, columns, vertices } = seen[name];
      const off = meanDepth(vertices) / truth - 1;
      t.diagnostic(`${name}: f ${camera.fx}, ${camera.source}, depth off by ${(100 * off).toFixed(2)} %`);
      assert.ok(found, name);
      assert.deepEqual([camera.source, camera.width, camera.height, camera.cx, camera.cy, columns], [source, 800, 450, 400, 225, 480], name);
      assert.ok(Math.abs(camera.fx - focal) < 0.01 && camera.fy === camera.fx, `${name}: ${camera.fx}`);
      if (source === "exif") assert.ok(Math.abs(off) < MAX_ERROR, `${name}: ${off}`);
      else assert.ok(Math.abs(off) > 0.1, "the guess is far off");
      const { camera: native } = JSON.parse(await readFile(join(folder, "native", name, "report.json"), "utf8"));
      assert.deepEqual([native.source, native.width, native.height], [source === "exif" ? "exif" : "assumed", 800, 450], name);
      assert.ok(Math.abs(native.fx - camera.fx) < 1e-9, `${name}: ${native.fx}`);
    }
    assert.equal(seen.given.camera.source, "estimated");
    // A picture's mesh is fitted, and a sheet that is fitted tells the camera where nobody knows it.
    const { camera, vertices } = seen.told;
    const off = meanDepth(vertices) / truth - 1;
    t.diagnostic(`told by the sheet: f ${camera.fx} (+- ${camera.spread}), depth off by ${(100 * off).toFixed(2)} %`);
    assert.equal(camera.source, "calibrated");
    assert.ok(Math.abs(camera.fx - 760) < Math.min(2 * camera.spread, 60) && Math.abs(off) < 0.08, `${camera.fx} ${off}`);
    const { camera: native } = JSON.parse(await readFile(join(folder, "told", "plain", "report.json"), "utf8"));
    assert.ok(native.source === "sheet" && Math.abs(native.fx / camera.fx - 1) < 0.01, JSON.stringify(native));
  }),
);

test("the page says that a photograph's EXIF data tell its camera", { timeout: SLOW_MS }, async () => {
  const browser = await launch({ webgpu: false });
  try {
    const demo = await openDemo(browser, { device: DESKTOP, query: "?device=cpu" });
    const buffer = await photograph(demo.page, picture, { equivalentMm: EQUIVALENT_MM, orientation: 6 });
    await demo.page.setInputFiles("#image-file", { name: "photograph.jpg", mimeType: "image/jpeg", buffer });
    await demo.page.waitForSelector('#state[data-state="found"]');
    assert.match(await demo.page.textContent("#camera-row"), /f 764 px.*800 × 450.*EXIF/s);
    await demo.finish();
  } finally {
    await browser.close();
  }
});
