// What phones ask of the examples, which no browser here is: they play only videos that say so.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { WWW } from "../../serve.mjs";

const FOLDER = join(WWW, "examples");

test("each video of the examples plays inline and muted, and the clip has a coding for each browser", () => {
  for (const name of readdirSync(FOLDER).filter((name) => /\.(html|js)$/.test(name))) {
    const text = readFileSync(join(FOLDER, name), "utf8");
    for (const [video] of text.matchAll(/<video\b[^>]*>/g)) assert.match(video, /playsinline muted/, name);
    for (const [options] of text.matchAll(/\{[^{}]*\bsrc: clip[^{}]*\bloop[^{}]*\}/g)) assert.match(options, /muted: true.*playsInline: true/, name);
    if (name !== "source.js") assert.doesNotMatch(text, /clip\.(webm|mp4)/, name);
  }
});
