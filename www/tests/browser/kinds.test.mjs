// What people bring: one small file of each kind, in tests/kinds, and what becomes of it in the page. kinds.json there says what is
// expected, on the command line too.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";

import { SLOW_MS } from "../support/browser.mjs";
import { onPage } from "../support/page.mjs";

const FOLDER = new URL("../../../tests/kinds/", import.meta.url);
const { outcomes } = JSON.parse(await readFile(new URL("kinds.json", FOLDER), "utf8"));

test("each kind of file is read, or refused with file, cause and remedy", { timeout: SLOW_MS }, () =>
  onPage({}, async ({ page }) => {
    await page.evaluate(async () => (globalThis.sft = await deepsft.DeepSft.load()));
    for (const { file, is, with: beside = [], page: expected } of outcomes.filter(({ page }) => page)) {
      const files = await Promise.all([file, ...beside].map(async (name) => [name, (await readFile(new URL(name, FOLDER))).toString("base64")]));
      const said = await page.evaluate(
        async ([is, given]) => {
          const files = given.map(([name, base64]) => new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
          try {
            const target = await (is === "picture" ? sft.addPicture(files[0], { widthMm: 40 }) : sft.addScan(files));
            sft.removeTarget(target);
            return `read: ${target.kind}, ${target.widthMm.toFixed(3)} x ${target.heightMm.toFixed(3)}`;
          } catch (error) {
            return `${error instanceof deepsft.DeepSftError ? error.code : "not ours"}: ${error.message}`;
          }
        },
        [is, files],
      );
      // The print is that of 40 x 30 mm, whatever brought it.
      const words = expected.refused ? [file, ...expected.refused] : ["read: picture, 40.000 x 30.000"];
      for (const word of words) assert.ok(said.includes(word), `${is} ${file}: "${word}" is not in "${said}"`);
    }
  }),
);
