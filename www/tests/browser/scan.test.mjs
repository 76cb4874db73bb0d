// A person's own scan: read, laid flat, shown on the page, and followed before a camera.

import assert from "node:assert/strict";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";

import { DESKTOP, PHONE, SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { median } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { BLANK, onPage } from "../support/page.mjs";
import { encodePng } from "../support/png.mjs";
import { makePrint } from "../support/prints.mjs";
import { ball, bentSheet, glbOf, objOf } from "../support/scans.mjs";
import { y4m } from "../support/y4m.mjs";

/** A postcard that nothing was trained for, and its scan: rolled by 106 degrees. */
const PRINT = makePrint({ width: 740, height: 525, seed: 7 });
const [WIDTH_MM, HEIGHT_MM] = [148, 105];
const SHEET = bentSheet({ widthMm: WIDTH_MM, heightMm: HEIGHT_MM, radiusMm: 80 });
const CLIP_SEED = 970_042;
/** Chords of 3.7 mm on a radius of 80 mm are shorter than their arcs by a hundredth of a percent; sizes are rounded to a tenth of a millimetre. */
const SIZE_MM = 0.1;

let folder;
let cameraFile;
let truth;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-scan-"));
    const picture = join(folder, "print.png");
    await writeFile(picture, encodePng(PRINT));
    const { frames } = await makeClip({ event: "still", frames: 4, seed: CLIP_SEED, scale: 2, picture, widthMm: WIDTH_MM });
    truth = frames[0].vertices;
    cameraFile = join(folder, "camera.y4m");
    await writeFile(cameraFile, y4m(frames.map((frame) => frame.picture), 4)); // prettier-ignore
  },
  { timeout: SLOW_MS },
);
after(() => rm(folder, { recursive: true, force: true }));

const file = (name, buffer) => ({ name, mimeType: "application/octet-stream", buffer });
const GLB = file("postcard.glb", glbOf(SHEET, PRINT));
const BALL = file("ball.glb", glbOf(ball(60), PRINT));
/** The same in centimetres: an OBJ says no unit, so it counts as a card of 14.8 mm. */
const OBJ = (() => {
  const { obj, mtl } = objOf({ ...SHEET, positions: SHEET.positions.map((p) => p.map((mm) => mm / 10)) }, "print.png");
  return [file("postcard.obj", obj), file("sheet.mtl", mtl), file("print.png", encodePng(PRINT))];
})();

test("a bent sheet is laid flat with its size and its picture; what has a volume is taken as it is, and what is broken says why", { timeout: SLOW_MS }, () =>
  onPage({}, async ({ page }) => {
    const files = (given) => given.map(({ name, buffer }) => [name, buffer.toString("base64")]);
    await page.evaluate(() => {
      globalThis.base64Of = (bytes) => {
        let text = "";
        for (let at = 0; at < bytes.length; at += 32_768) text += String.fromCharCode(...bytes.subarray(at, at + 32_768));
        return btoa(text);
      };
      globalThis.filesOf = (given) => new Map(given.map(([name, base64]) => [name, Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]));
    });
    const scans = await page.evaluate(
      async ([glb, obj, volume]) => {
        const sft = (globalThis.sft = await deepsft.DeepSft.load());
        const read = async (given, options) => {
          const scan = await sft.readScan(filesOf(given), options);
          const { sheet } = scan;
          return { ...scan, sizeMm: scan.sizeMm, vertices: scan.vertices.length, mesh: scan.mesh.faces.length, normals: null, texture: null, sheet: sheet && { ...sheet, picture: [sheet.picture.width, sheet.picture.height, base64Of(sheet.picture.data)] } };
        };
        return [await read(glb), await read(obj, { mmPerUnit: 10 }), await read(volume)];
      },
      [files([GLB]), files(OBJ), files([BALL])],
    );
    for (const { name, sheet, refusal, sizeMm } of scans.slice(0, 2)) {
      assert.equal(refusal, null, name);
      assert.ok(Math.abs(sheet.widthMm - WIDTH_MM) < SIZE_MM && Math.abs(sheet.heightMm - HEIGHT_MM) < SIZE_MM, `${name}: ${sheet.widthMm} x ${sheet.heightMm}`);
      // As it stands: a chord of 106 degrees, and its depth.
      assert.ok(Math.abs(sizeMm[0] - 2 * 80 * Math.sin(0.925)) < 0.1 && Math.abs(sizeMm[2] - 80 * (1 - Math.cos(0.925))) < 0.1, `${sizeMm}`);
      const [width, height, base64] = sheet.picture;
      const rgba = Buffer.from(base64, "base64");
      let same = 0;
      for (let y = 0; y < height; y++)
        for (let x = 0; x < width; x++) {
          const from = 3 * (Math.floor(((y + 0.5) / height) * PRINT.height) * PRINT.width + Math.floor(((x + 0.5) / width) * PRINT.width));
          const at = 4 * (y * width + x);
          if ([0, 1, 2].every((k) => Math.abs(rgba[at + k] - PRINT.values[from + k]) < 40)) same++;
        }
      assert.ok(same > 0.9 * width * height, `${name}: ${same / (width * height)} of the flat picture is the print's`);
    }
    assert.equal(scans[2].sheet, null);
    assert.match(scans[2].refusal, /closed|bulges/);
    const target = await page.evaluate(async (given) => {
      const { name, kind, widthMm, heightMm, grade } = await sft.addScan(filesOf(given), { widthMm: 100 });
      return { name, kind, widthMm, heightMm, level: grade.level };
    }, files([GLB]));
    assert.ok(Math.abs(target.heightMm - (100 * HEIGHT_MM) / WIDTH_MM) < SIZE_MM, `${target.heightMm}`);
    assert.deepEqual({ ...target, heightMm: 0 }, { name: "postcard.glb", kind: "picture", widthMm: 100, heightMm: 0, level: "good" });
    const solid = await page.evaluate(async (given) => {
      const [scan, width] = [await sft.readScan(filesOf(given)), await sft.addScan(filesOf(given), { widthMm: 100 }).catch(({ message }) => message)];
      const { name, kind, mesh } = await sft.addScan(scan);
      return { name, kind, same: mesh.faces.length === scan.mesh.faces.length, width };
    }, files([BALL]));
    assert.deepEqual({ ...solid, width: "" }, { name: "ball.glb", kind: "template", same: true, width: "" });
    assert.match(solid.width, /has a volume .*: give mmPerUnit instead/);
    const [obj, mtl] = OBJ;
    const refused = {
      "nothing": [[], /no scan/],
      "two scans": [[GLB, obj], /several scans/],
      "half a file": [[file("half.glb", GLB.buffer.subarray(0, 5000))], /half\.glb cannot be used/],
      "no file of materials": [[obj], /sheet\.mtl is missing/],
      "no texture": [[obj, mtl], /print\.png is missing/],
      "words": [[file("words.obj", Buffer.from("v one two three"))], /line 1/],
    };
    for (const [what, [given, said]] of Object.entries(refused)) {
      const error = await page.evaluate(
        (given) => sft.addScan(filesOf(given)).then(() => "added", ({ code, message }) => ({ code, message })),
        files(given),
      );
      assert.equal(error.code, "target-unusable", `${what}: ${JSON.stringify(error)}`);
      assert.match(error.message, said, what);
    }
    assert.ok(page.url().endsWith(BLANK));
  }),
);

async function withDemo(launchOptions, demoOptions, body) {
  const browser = await launch(launchOptions);
  try {
    const demo = await openDemo(browser, { query: "?device=cpu", ...demoOptions });
    await body(demo);
    await demo.finish();
  } finally {
    await browser.close();
  }
}

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`on a ${name} a scan is shown, its size corrected, and its sheet followed before the camera`, { timeout: 2 * SLOW_MS }, () =>
    withDemo({ camera: cameraFile }, { device, permissions: ["camera"] }, async ({ page, screenshot }) => {
      await page.evaluate(() => {
        globalThis.meshes = [];
        document.addEventListener("deepsft-tracked", ({ tracked }) => {
          if (tracked.found) globalThis.meshes.push([...tracked.mesh.vertices]);
        });
      });
      // In centimetres, without a unit in the file.
      await page.setInputFiles("#scan-file", OBJ);
      await page.waitForSelector('#scan[data-state="sheet"]');
      assert.equal(await page.textContent("#scan-name"), "postcard.obj");
      assert.equal(await page.inputValue("#scan-width"), "14.8");
      assert.match(await page.textContent("#scan-problem"), /Is that right\?/);
      await page.fill("#scan-width", "14,8 cm");
      assert.equal(await page.textContent("#scan-height"), "105");
      assert.equal(await page.textContent("#scan-box"), "The scan measures 128 × 105 × 31.9 mm.");
      assert.equal(await page.textContent("#scan-problem"), "");
      await page.waitForTimeout(500);
      await screenshot(`${name}-scan-sheet`);
      // The shape is drawn, and is turned by the keyboard.
      const shape = page.locator("#scan-shape");
      const before = await shape.screenshot();
      await shape.press("ArrowLeft");
      for (let i = 0; i < 5; i++) await shape.press("ArrowUp");
      assert.notDeepEqual(await shape.screenshot(), before);
      // Nothing of it is left when the browser takes the graphics context, and it is drawn again when that is back.
      const context = await shape.evaluateHandle((canvas) => canvas.getContext("webgl2").getExtension("WEBGL_lose_context"));
      const change = (to) =>
        shape.evaluate(
          async (canvas, [context, to]) => {
            const changed = new Promise((resolve) => canvas.addEventListener(`webglcontext${to === "lose" ? "lost" : "restored"}`, resolve, { once: true }));
            context[`${to}Context`]();
            await changed;
          },
          [context, to],
        );
      await change("lose");
      await page.waitForTimeout(300);
      const lost = await shape.screenshot();
      await change("restore");
      await page.waitForTimeout(500);
      const restored = await shape.screenshot();
      assert.notDeepEqual(restored, lost);
      await shape.press("ArrowUp");
      assert.notDeepEqual(await shape.screenshot(), restored);
      await page.click('#scan [value="camera"]');
      await page.waitForSelector('#state[data-how="tracked"]');
      await page.waitForFunction(() => globalThis.meshes.length >= 3);
      assert.match(await page.locator("#model").textContent(), /postcard\.obj, 148 × 105 mm/);
      await page.click('[value="object"]');
      await page.waitForTimeout(500);
      await screenshot(`${name}-scan-object`);
      const apart = median((await page.evaluate(() => globalThis.meshes)).map((mesh) => meshDistance(mesh, truth).medianPx));
      // As of a picture in own-picture.test.mjs.
      assert.ok(apart < 1, `${apart} canonical pixels from the truth`);
      await page.click("#back");
      assert.equal(await page.textContent("#last-name"), "postcard.obj");
      assert.equal(await page.textContent("#last-size"), "148 × 105 mm");
      await page.reload();
      await page.waitForSelector("#last:not([hidden])");
      assert.equal(await page.textContent("#last-size"), "148 × 105 mm", "it is remembered on the device");
    }),
  );
}

test("a folder with a scan and its textures may be dropped", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: DESKTOP }, async ({ page }) => {
    const scan = join(folder, "scan");
    await mkdir(join(scan, "maps"), { recursive: true });
    const [obj, mtl, print] = OBJ;
    for (const [name, { buffer }] of [[obj.name, obj], [mtl.name, mtl], [join("maps", print.name), print]]) await writeFile(join(scan, name), buffer);
    const cdp = await page.context().newCDPSession(page);
    const data = { items: [], files: [scan], dragOperationsMask: 1 };
    for (const type of ["dragEnter", "dragOver", "drop"]) await cdp.send("Input.dispatchDragEvent", { type, x: 200, y: 200, data });
    await page.waitForSelector('#scan[data-state="sheet"]');
  }),
);

test("what has a volume says what to do instead, and broken files what is wrong with them", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: PHONE }, async ({ page, screenshot }) => {
    // Dropped on the page.
    const data = await page.evaluateHandle((base64) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], "ball.glb"));
      return transfer;
    }, BALL.buffer.toString("base64"));
    await page.dispatchEvent("body", "drop", { dataTransfer: data });
    await page.waitForSelector('#scan[data-state="volume"]');
    assert.match(await page.textContent("#scan-verdict"), /^This page follows sheets.*sft\.addScan in pages\. /);
    assert.equal(await page.isVisible('#scan [value="camera"]'), false);
    assert.ok(await page.isVisible(".otherwise a"));
    await page.waitForTimeout(500);
    await screenshot("phone-scan-volume");
    await page.setInputFiles("#scan-file", fileURLToPath(new URL("../../../tests/kinds/scan.zip", import.meta.url)));
    await page.waitForSelector('#scan[data-state="sheet"]');
    assert.deepEqual([await page.textContent("#scan-name"), await page.inputValue("#scan-width")], ["sheet.obj", "40"]);
    await page.waitForTimeout(500);
    await screenshot("phone-scan-zip");
    for (const [given, said] of [
      [[file("empty.glb", Buffer.alloc(0))], /empty\.glb cannot be used/],
      [[OBJ[0]], /sheet\.mtl is missing: choose it together with the scan/],
      [[file("scan.zip", Buffer.from("PK"))], /scan\.zip cannot be unpacked: it was cut short/],
    ]) {
      await page.setInputFiles("#scan-file", given);
      const { code, title } = await messageOf(page);
      assert.deepEqual([code, title], ["scan-unusable", "This scan cannot be used"]);
      assert.match(await page.textContent("#message-advice"), said);
      await screenshot(`phone-scan-${given[0].name}`);
      assert.deepEqual(await page.locator("#message-remedies button").allTextContents(), ["Choose another scan"]);
      await page.click("#message-close");
    }
  }),
);
