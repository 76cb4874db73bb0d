// A person's own picture on the page: from a file or the camera to its corners, its size, and a mesh on its print.

import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { DESKTOP, PHONE, SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";
import { makeClip } from "../support/clips.mjs";
import { median } from "../support/maps.mjs";
import { meshDistance } from "../support/meshes.mjs";
import { encodePng } from "../support/png.mjs";
import { makePrint } from "../support/prints.mjs";
import { y4m } from "../support/y4m.mjs";
import { outlineHomography } from "../../src/targets/rectify.js";

/** A postcard that nothing was trained for. */
const PRINT = { width: 740, height: 525, seed: 7 };
const WIDTH_MM = 148;
const CLIP_SEED = 970_042;

let folder;
let png;
let cameraFile;
let truth;

before(
  async () => {
    folder = await mkdtemp(join(tmpdir(), "deepsft-own-"));
    const picture = join(folder, "print.png");
    png = encodePng(makePrint(PRINT));
    await writeFile(picture, png);
    const options = { event: "still", frames: 4, seed: CLIP_SEED, scale: 2, picture, widthMm: WIDTH_MM };
    const { frames } = await makeClip(options);
    truth = frames[0].vertices;
    cameraFile = join(folder, "camera.y4m");
    await writeFile(cameraFile, y4m(frames.map((frame) => frame.picture), 4)); // prettier-ignore
  },
  { timeout: SLOW_MS },
);
after(() => rm(folder, { recursive: true, force: true }));

const file = (buffer, name = "harbour.png", mimeType = "image/png") => ({ name, mimeType, buffer });

/** The page in a browser of its own. */
async function withDemo(launchOptions, demoOptions, body) {
  const browser = await launch(launchOptions);
  try {
    const prepare = (context) => context.addInitScript(lookAtKept);
    const demo = await openDemo(browser, { query: "?device=cpu", prepare, ...demoOptions });
    await body(demo);
    await demo.finish();
  } finally {
    await browser.close();
  }
}

/** Gives the page `keptPicture()`: what it keeps on the device. */
function lookAtKept() {
  globalThis.keptPicture = () =>
    new Promise((resolve, reject) => {
      const request = indexedDB.open("deepsft-demo", 1);
      request.onerror = () => reject(request.error);
      request.onsuccess = () => {
        const get = request.result.transaction("pictures").objectStore("pictures").get("last");
        get.onsuccess = () => {
          request.result.close();
          resolve(get.result);
        };
      };
    });
}

/** Middles of the corner handles, CSS pixels. */
const handlesOf = (page) =>
  page.locator(".corner").evaluateAll((handles) =>
    handles.map((handle) => {
      const { left, top, width, height } = handle.getBoundingClientRect();
      return [left + width / 2, top + height / 2];
    }),
  );

const valueOf = async (page, selector) => Number(await page.inputValue(selector));

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`on a ${name} a picture file becomes a mesh on its print`, { timeout: 2 * SLOW_MS }, () =>
    withDemo({ camera: cameraFile }, { device, permissions: ["camera"] }, async ({ page, screenshot }) => {
      await page.evaluate(() => {
        globalThis.meshes = [];
        document.addEventListener("deepsft-tracked", ({ tracked }) => {
          if (tracked.found) globalThis.meshes.push([...tracked.mesh.vertices]);
        });
      });
      await page.setInputFiles("#picture-file", file(png));
      await page.click('[value="postcard"]');
      assert.deepEqual([await valueOf(page, "#print-width"), await valueOf(page, "#print-height")], [148, 105]);
      await screenshot(`${name}-own-size`);
      await page.click('#print-size [value="camera"]');
      await page.waitForSelector('#state[data-how="tracked"]');
      await page.waitForFunction(() => globalThis.meshes.length >= 3);
      assert.match(await page.textContent("#state-text"), /^Tracked/);
      assert.match(await page.locator("#model").textContent(), /harbour\.png, 148 × 105 mm/);
      for (const overlay of ["paper", "object", "shaded", "mesh", "depth", "plain"]) {
        await page.click(`[value="${overlay}"]`);
        await page.waitForSelector(`[value="${overlay}"]:checked`);
        await screenshot(`${name}-own-${overlay}`);
      }
      const meshes = await page.evaluate(() => globalThis.meshes);
      // The page's camera has a focal length of 0.79 of the width, the clip's 0.7917.
      const apart = median(meshes.map((mesh) => meshDistance(mesh, truth).medianPx));
      assert.ok(apart < 1, `${apart} canonical pixels from the truth`);
      // Back, and on from what is remembered.
      await page.click("#back");
      assert.equal(await page.textContent("#last-name"), "harbour.png");
      await page.click("#last-use");
      await page.waitForSelector('#state[data-how="tracked"]');
    }),
  );
}

test("a print whose size nobody knows is followed, and no distance is told", { timeout: SLOW_MS }, () =>
  withDemo({ camera: cameraFile }, { device: PHONE, permissions: ["camera"] }, async ({ page, screenshot }) => {
    await page.setInputFiles("#picture-file", file(png));
    await page.click('[value="unknown"]');
    assert.equal(await page.inputValue("#print-width"), "");
    assert.ok(await page.isVisible("#size-unknown"));
    await screenshot("phone-own-size-unknown");
    await page.click('#print-size [value="camera"]');
    await page.waitForSelector('#state[data-how="tracked"]');
    await page.waitForSelector("#measures:not([hidden])");
    assert.match(await page.textContent("#measures"), /^(Flat|Bent by \d+°)$/);
    assert.match(await page.locator("#model").textContent(), /harbour\.png, size not known/);
    await page.click('[value="depth"]');
    assert.equal(await page.isVisible("#scale"), false);
    // What was typed beside it is a size of its own.
    await page.click("#back");
    assert.equal(await page.textContent("#last-size"), "Size not known");
    await page.click("#last-edit");
    assert.ok(await page.isChecked('[value="unknown"]'));
    await page.fill("#print-height", "105");
    assert.deepEqual([await valueOf(page, "#print-width"), await page.isVisible("#size-unknown")], [148, false]);
  }),
);

test("a photograph shows where its print is, and the size is fitted to the mesh", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: DESKTOP }, async ({ page, screenshot }) => {
    await page.setInputFiles("#picture-file", file(png));
    const chooser = page.waitForEvent("filechooser");
    await page.fill("#print-width", "14,8 cm");
    await page.click('#print-size [value="image"]');
    const frame = encodePng({ width: 900, height: 700, values: photographOf(CORNERS).rgb });
    await (await chooser).setFiles(file(frame, "photo.png"));
    await page.waitForSelector('#live[data-mesh="true"]');
    assert.match(await page.textContent("#state-text"), /^Found/);
    await screenshot("desktop-own-photo");
  }),
);

/**
 * The postcard's corners in a photograph of 900 x 700 pixels, from 230 mm away and tilted by 35 degrees about its long side:
 * those of a camera with the focal length that the page takes for granted, 0.79 of the long side.
 */
const CORNERS = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i, j]) => {
  const [x, y, z] = [74 * i, 52.5 * j * Math.cos(0.61), 230 - 52.5 * j * Math.sin(0.61)];
  return [450 + (711 * x) / z, 350 + (711 * y) / z];
}); // prettier-ignore

/** The print as a camera sees it lie flat with its corners there. */
function photographOf(corners, [width, height] = [900, 700]) {
  const print = makePrint(PRINT);
  const [a, b, c, d, e, f, g, h, i] = outlineHomography(corners, print.width, print.height);
  // From the photograph to the print: the inverse, up to its scale.
  const back = [e * i - f * h, c * h - b * i, b * f - c * e, f * g - d * i, a * i - c * g, c * d - a * f, d * h - e * g, b * g - a * h, a * e - b * d];
  const rgb = new Uint8Array(3 * width * height).fill(120);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const [p, q, r] = [0, 3, 6].map((row) => back[row] * (x + 0.5) + back[row + 1] * (y + 0.5) + back[row + 2]);
      const [u, v] = [Math.floor(p / r), Math.floor(q / r)];
      if (u < 0 || v < 0 || u >= print.width || v >= print.height) continue;
      const from = 3 * (v * print.width + u);
      rgb.set(print.values.subarray(from, from + 3), 3 * (y * width + x));
    }
  }
  return { width, height, rgb };
}

for (const [name, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  test(`on a ${name} dragging four corners flattens a photographed print`, { timeout: SLOW_MS }, async () => {
    const { width, height, rgb } = photographOf(CORNERS);
    await withDemo({}, { device }, async ({ page, screenshot }) => {
      await page.setInputFiles("#picture-file", file(encodePng({ width, height, values: rgb }), "table.png"));
      await page.waitForSelector("#editor:not([hidden])");
      const whole = await handlesOf(page);
      const scale = (whole[1][0] - whole[0][0]) / width;
      for (const [i, [x, y]] of CORNERS.entries()) {
        // Off the handle's middle: the corner must not jump to the finger.
        const [fromX, fromY] = [whole[i][0] + 7, whole[i][1] - 5];
        await page.mouse.move(fromX, fromY);
        await page.mouse.down();
        await page.mouse.move(whole[0][0] + x * scale + 7, whole[0][1] + y * scale - 5, { steps: 5 });
        assert.ok(await page.isVisible(".loupe"));
        if (i === 2) await screenshot(`${name}-own-corner`);
        await page.mouse.up();
        assert.equal(await page.isVisible(".loupe"), false);
      }
      await page.click('[value="postcard"]');
      assert.deepEqual([await valueOf(page, "#print-width"), await valueOf(page, "#print-height")], [148, 105]);
      await screenshot(`${name}-own-corners`);
      const flat = await page.evaluate(
        () =>
          new Promise((resolve) =>
            requestAnimationFrame(() =>
              requestAnimationFrame(() => {
                const canvas = document.querySelector("#flat");
                const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                // As a text: a list of so many numbers takes seconds to hand over.
                let text = "";
                for (let at = 0; at < data.length; at += 32_768) text += String.fromCharCode(...data.subarray(at, at + 32_768));
                resolve({ width: canvas.width, height: canvas.height, base64: btoa(text) });
              }),
            ),
          ),
      );
      assert.ok(Math.abs(flat.width / flat.height - 148 / 105) < 0.01);
      const rgba = Buffer.from(flat.base64, "base64");
      // Half a pixel of the screen is more than a pixel of the photograph, which blurs edges: most of it is the same all the same.
      const print = makePrint(PRINT);
      let same = 0;
      for (let y = 0; y < flat.height; y++) {
        for (let x = 0; x < flat.width; x++) {
          const [u, v] = [Math.floor(((x + 0.5) / flat.width) * print.width), Math.floor(((y + 0.5) / flat.height) * print.height)];
          const [at, from] = [4 * (y * flat.width + x), 3 * (v * print.width + u)];
          if ([0, 1, 2].every((k) => Math.abs(rgba[at + k] - print.values[from + k]) < 40)) same++;
        }
      }
      const fraction = same / (flat.width * flat.height);
      assert.ok(fraction > 0.8, `${fraction} of the flat picture is the print's`);
      // Nothing lets the outline turn inside out.
      const [topLeft, , bottomRight] = await handlesOf(page);
      await page.mouse.move(...topLeft);
      await page.mouse.down();
      await page.mouse.move(bottomRight[0] + 30, bottomRight[1] + 30, { steps: 12 });
      await page.mouse.up();
      const [kept, , opposite] = await handlesOf(page);
      assert.ok(kept[0] < opposite[0] && kept[1] < opposite[1]);
      await page.click("#whole");
      assert.deepEqual(await handlesOf(page), whole);
      // Turned by a quarter, the picture stands.
      await page.click("#turn");
      assert.ok((await valueOf(page, "#print-width")) < (await valueOf(page, "#print-height")));
    });
  });
}

test("corners move by the keyboard, and say where they are", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: DESKTOP }, async ({ page, screenshot }) => {
    await page.setInputFiles("#picture-file", file(png));
    await page.waitForSelector("#editor:not([hidden])");
    const before = await handlesOf(page);
    // From the heading, which has the focus, back to the corner before the last.
    for (let i = 0; i < 2; i++) await page.keyboard.press("Shift+Tab");
    assert.equal(await page.evaluate(() => document.activeElement.getAttribute("aria-label")), "Bottom right corner");
    for (const key of ["ArrowLeft", "ArrowLeft", "Shift+ArrowUp", "ArrowDown"]) await page.keyboard.press(key);
    const after = await handlesOf(page);
    assert.ok(Math.abs(after[2][0] - (before[2][0] - 2)) < 0.6 && Math.abs(after[2][1] - (before[2][1] - 11)) < 0.6);
    assert.match(await page.textContent(".said"), /^\d+ % across, \d+ % down$/);
    assert.ok(await page.isVisible(".loupe"));
    await screenshot("desktop-own-keyboard");
    await page.keyboard.press("Escape");
    assert.ok(await page.isVisible("#choose-picture"));
  }),
);

test("a print is photographed with the camera, and its corners are near already", { timeout: SLOW_MS }, () =>
  withDemo({ camera: cameraFile }, { device: PHONE, permissions: ["camera"] }, async ({ page, screenshot }) => {
    await page.click("#photograph");
    await page.waitForSelector('#capture[data-ready="true"]');
    await screenshot("phone-own-capture");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#editor:not([hidden])");
    assert.ok(await page.getByText("Drag the corners onto those of the print.").isVisible());
    assert.equal(await page.isEnabled("#whole"), true);
    // The camera is free again.
    assert.equal(await page.evaluate(() => document.querySelector("#capture video").srcObject), null);
    await page.click('[value="a5"]');
    assert.deepEqual([await valueOf(page, "#print-width"), await valueOf(page, "#print-height")], [210, 148]);
    await screenshot("phone-own-photographed");
  }),
);

test("the whole way on a phone: a photographed print of unknown size is found, printed anew, kept as a picture and a film", { timeout: SLOW_MS }, async () => {
  const onTable = join(folder, "table.y4m");
  await writeFile(onTable, y4m(Array(4).fill(photographOf(CORNERS)), 4));
  await withDemo({ camera: onTable }, { device: PHONE, permissions: ["camera"] }, async ({ page, screenshot }) => {
    let step = 0;
    const look = (name) => screenshot(`phone-way-${++step}-${name}`);
    const kept = async (act) => (await Promise.all([page.waitForEvent("download"), act()]))[0].suggestedFilename();
    await look("start");
    await page.tap("#photograph");
    await page.waitForSelector('#capture[data-ready="true"]');
    await look("capture");
    await page.tap(".shutter");
    await page.waitForSelector("#editor:not([hidden])");
    await look("editor");
    const handles = await handlesOf(page);
    const box = await page.locator("#corners .picture").boundingBox();
    for (const [i, [x, y]] of CORNERS.entries()) {
      await page.mouse.move(...handles[i]);
      await page.mouse.down();
      await page.mouse.move(box.x + (x / 900) * box.width, box.y + (y / 700) * box.height, { steps: 5 });
      await page.mouse.up();
    }
    await look("corners");
    await page.tap('label:has([value="unknown"])');
    await look("unknown");
    const { scrollWidth, clientWidth } = await page.locator("#usual-sizes").evaluate(({ scrollWidth, clientWidth }) => ({ scrollWidth, clientWidth }));
    assert.equal(scrollWidth, clientWidth, "all sizes are seen");
    await page.tap('#print-size [value="camera"]');
    await look("learning");
    await page.waitForSelector('#state[data-how="tracked"]');
    await page.waitForSelector("#measures:not([hidden])");
    await look("found");
    for (const overlay of ["object", "depth"]) {
      await page.tap(`#overlays label:has([value="${overlay}"])`);
      await page.waitForTimeout(1000);
      await look(overlay);
    }
    await page.tap('#overlays label:has([value="paper"])');
    assert.match(await kept(() => page.tap("#shots button:first-child")), /\.png$/);
    await page.tap("#shots button:last-child");
    await page.waitForTimeout(2500);
    await look("recording");
    assert.match(await kept(() => page.tap("#shots button:last-child")), /\.(mp4|webm)$/);
    await page.tap("#back");
    await look("back");
    assert.equal(await page.textContent("#last-size"), "Size not known");
  });
});

test("the last picture is remembered on the device until it is forgotten", { timeout: SLOW_MS }, () =>
  withDemo({ camera: cameraFile }, { device: PHONE }, async ({ page, screenshot }) => {
    assert.equal(await page.isVisible("#last"), false);
    await page.setInputFiles("#picture-file", file(png));
    await page.waitForSelector("#editor:not([hidden])");
    // The arrow keys go past what they choose; a tap on "Other" goes on to the width.
    await page.focus('[value="card"]');
    for (const value of ["own", "unknown"]) {
      await page.keyboard.press("ArrowRight");
      assert.equal(await page.evaluate(() => document.activeElement.value), value);
    }
    await page.click('[value="own"]');
    assert.equal(await page.evaluate(() => document.activeElement.id), "print-width");
    await page.click('#units [value="cm"]');
    await page.fill("#print-width", "12,5");
    await page.click('#print-size [value="camera"]');
    const { code } = await messageOf(page);
    assert.equal(code, "camera-denied");
    assert.deepEqual(await page.locator("#message-remedies button").allTextContents(), [
      "Try again",
      "Choose another picture",
      "Open an image",
    ]);
    await screenshot("phone-own-denied");
    await page.click("#message-close");
    await page.waitForFunction(() => keptPicture().then((kept) => kept !== undefined));
    await page.reload();
    await page.waitForSelector("#last:not([hidden])");
    assert.equal(await page.textContent("#last-name"), "harbour.png");
    assert.equal(await page.textContent("#last-size"), "125 × 88.7 mm");
    await screenshot("phone-own-remembered");
    await page.click("#last-edit");
    assert.equal(await page.inputValue("#print-width"), "12.5");
    await page.click("#editor .leave");
    await page.click("#last-forget");
    assert.equal(await page.isVisible("#last"), false);
    await page.waitForFunction(() => keptPicture().then((kept) => kept === undefined));
    await page.reload();
    assert.equal(await page.evaluate(() => keptPicture()), undefined);
    assert.equal(await page.isVisible("#last"), false);
  }),
);

test("what is wrong with a picture or its size is said in words", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: PHONE }, async ({ page, screenshot }) => {
    const refused = async (buffer, name, code) => {
      await page.setInputFiles("#picture-file", file(buffer, name));
      assert.equal((await messageOf(page)).code, code, name);
      await screenshot(`phone-own-${code}`);
      await page.click("#message-close");
    };
    await refused(Buffer.alloc(0), "empty.png", "image-unreadable");
    await refused(Buffer.from("hello"), "words.png", "image-unreadable");
    await refused(encodePng({ width: 3, height: 3, values: new Uint8Array(27) }), "dot.png", "picture-small");
    const clear = new Uint8Array(4 * 200 * 100);
    await refused(encodePng({ width: 200, height: 100, channels: 4, values: clear }), "clear.png", "picture-empty");

    // Half of it see-through: white paper.
    for (let i = 0; i < 100 * 200; i++) clear.set([200, 0, 0, i % 200 < 100 ? 255 : 0], 4 * i);
    await page.setInputFiles("#picture-file", file(encodePng({ width: 200, height: 100, channels: 4, values: clear })));
    await page.waitForSelector("#transparent:not([hidden])");
    const right = await page.evaluate(() => {
      const shown = document.querySelector("#corners .picture");
      return [...shown.getContext("2d").getImageData(shown.width - 4, 4, 1, 1).data];
    });
    assert.deepEqual(right, [255, 255, 255, 255]);

    const problemWith = async (width) => {
      await page.fill("#print-width", width);
      await page.click('#print-size [value="camera"]');
      assert.equal(await page.getAttribute("#print-width", "aria-invalid"), "true", width);
      return page.textContent("#size-problem");
    };
    assert.match(await problemWith(""), /How wide is the print/);
    await screenshot("phone-own-no-width");
    assert.match(await problemWith("wide"), /How wide is the print/);
    assert.match(await problemWith("0"), /How wide is the print/);
    assert.match(await problemWith("4"), /20 mm to 3 m/);
    assert.match(await problemWith("90000"), /20 mm to 3 m/);
    await page.fill("#print-width", "90");
    assert.equal(await page.textContent("#size-problem"), "");
    assert.equal(await page.inputValue("#print-height"), "45");
  }),
);

test("a blank picture is refused with what to do about it", { timeout: SLOW_MS }, () =>
  withDemo({ camera: cameraFile }, { device: PHONE, permissions: ["camera"] }, async ({ page, screenshot }) => {
    const blank = new Uint8Array(3 * 300 * 200).fill(240);
    await page.setInputFiles("#picture-file", file(encodePng({ width: 300, height: 200, values: blank }), "blank.png"));
    await page.click('[value="a4"]');
    await page.click('#print-size [value="camera"]');
    assert.equal((await messageOf(page)).code, "target-unusable");
    assert.deepEqual(await page.locator("#message-remedies button").allTextContents(), [
      "Choose another picture",
      "Change this one",
    ]);
    await screenshot("phone-own-blank");
    await page.getByRole("button", { name: "Change this one" }).click();
    assert.ok(await page.isVisible("#editor"));
  }),
);

test("a huge picture is made smaller before it is handed over", { timeout: SLOW_MS }, () =>
  withDemo({}, { device: DESKTOP }, async ({ page }) => {
    const [width, height] = [9000, 3000];
    const values = new Uint8Array(3 * width * height).fill(200);
    for (let i = 0; i < values.length; i += 3001) values[i] = 10;
    await page.setInputFiles("#picture-file", file(encodePng({ width, height, values }), "huge.png"));
    await page.fill("#print-width", "900");
    assert.equal(await page.inputValue("#print-height"), "300");
    await page.click('#print-size [value="camera"]');
    await messageOf(page);
    await page.click("#message-close");
    const size = await page.waitForFunction(() =>
      keptPicture().then((kept) => kept && createImageBitmap(kept.picture).then(({ width, height }) => [width, height])),
    );
    const [w, h] = await size.jsonValue();
    assert.ok(Math.max(w, h) <= 2000 && Math.abs(w / h - 3) < 0.01, `${w} x ${h}`);
  }),
);
