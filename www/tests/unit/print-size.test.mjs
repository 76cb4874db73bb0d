import assert from "node:assert/strict";
import { test } from "node:test";

import { formatLength, formatSize, largestOn, layOut, parseLength } from "../../demo/own/print-size.js";

test("lengths are read as people write them", () => {
  for (const [text, unit, mm] of [
    ["148", "mm", 148],
    ["14,8", "cm", 148],
    [" 14.8 ", "cm", 148],
    ["14.8 cm", "mm", 148],
    ["85.6MM", "cm", 85.6],
    [".5", "cm", 5],
    ["7.", "mm", 7],
  ])
    assert.ok(Math.abs(parseLength(text, unit) - mm) < 1e-9, text);
  for (const text of ["", " ", "wide", "-20", "1e3", "10 in", "1.2.3", ".", "NaN"])
    assert.ok(Number.isNaN(parseLength(text, "mm")), text);
});

test("lengths are written as they are read", () => {
  assert.equal(formatLength(148, "mm"), "148");
  assert.equal(formatLength(148, "cm"), "14.8");
  assert.equal(formatLength(85.6, "mm"), "85.6");
  assert.equal(formatLength(85.6, "cm"), "8.56");
  assert.equal(formatLength(148.4, "mm"), "148");
  assert.equal(formatSize(148, 105), "148 × 105 mm");
  assert.equal(formatSize(148, 105, "cm"), "14.8 × 10.5 cm");
});

test("a usual sheet lies as the picture does", () => {
  assert.deepEqual(layOut("a4", 0.7), [210, 297]);
  assert.deepEqual(layOut("a4", 1.5), [297, 210]);
});

test("a picture of other proportions is printed as large as the sheet allows, and never larger", () => {
  // 3:2 on a postcard of 148 x 105: 157.5 mm would be needed for the full height.
  const wide = largestOn("postcard", 1.5);
  assert.ok(Math.abs(wide.widthMm - 148) < 1e-9 && Math.abs(wide.heightMm - 148 / 1.5) < 1e-9);
  const square = largestOn("postcard", 1);
  assert.ok(Math.abs(square.widthMm - 105) < 1e-9 && Math.abs(square.heightMm - 105) < 1e-9);
  const tall = largestOn("a4", 0.5);
  assert.ok(Math.abs(tall.heightMm - 297) < 1e-9 && Math.abs(tall.widthMm - 148.5) < 1e-9);
});
