import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterEach, beforeEach, test } from "node:test";

import { WWW } from "../../serve.mjs";
import { LIST, writeSite } from "../../site.mjs";

let folder;
let out;
let parts;

/** @param {string} name below the test's folder */
function write(name, text) {
  mkdirSync(join(folder, name, ".."), { recursive: true });
  writeFileSync(join(folder, name), text);
}

/** All files in a folder, sorted. */
function files(at) {
  const entries = readdirSync(at, { recursive: true, withFileTypes: true });
  return entries.filter((entry) => entry.isFile()).map((entry) => join(entry.parentPath ?? entry.path, entry.name).slice(at.length + 1)).sort();
}

beforeEach(() => {
  folder = mkdtempSync(join(tmpdir(), "deepsft-site-"));
  out = join(folder, "out");
  for (const name of ["page.html", "models/m/model.json", "models/.hidden", "models/run.checkpoint/state.json"])
    write(`sources/${name}`, name);
  parts = { "index.html": join(folder, "sources/page.html"), models: join(folder, "sources/models") };
});
afterEach(() => rmSync(folder, { recursive: true, force: true }));

test("a site is its parts, without hidden files and checkpoints, and a list of them", async () => {
  assert.deepEqual(await writeSite(out, parts), ["index.html", "models/m/model.json"]);
  assert.deepEqual(files(out), ["index.html", "models/m/model.json", LIST].sort());
  assert.equal(readFileSync(join(out, "index.html"), "utf8"), "page.html");
});

test("the picture for those who show a link to the site has its whole address, and is small", async () => {
  const page = join(WWW, "index.html");
  const of = (/** @type {string} */ name) => /property="og:image" content="([^"]+)"/.exec(readFileSync(name, "utf8"))[1];
  const own = of(page);
  assert.ok(statSync(join(WWW, own)).size < 150_000);
  await writeSite(out, { "index.html": page }, "https://example.org/deepsft/");
  assert.equal(of(join(out, "index.html")), `https://example.org/deepsft/${own}`);
  await writeSite(out, { "index.html": page }, undefined);
  assert.equal(of(join(out, "index.html")), own);
});

test("a site replaces an older one as a whole, and leaves nothing beside it", async () => {
  await writeSite(out, parts);
  rmSync(join(folder, "sources/models/m/model.json"));
  write("sources/models/m/new.json", "new");
  await writeSite(out, parts);
  assert.deepEqual(files(out), ["index.html", "models/m/new.json", LIST].sort());
  assert.deepEqual(readdirSync(folder).sort(), ["out", "sources"]);
});

test("a folder with a file of another origin is refused by its name, and stays as it is", async () => {
  write("out/thesis.txt", "years of work");
  await assert.rejects(writeSite(out, parts), /thesis\.txt is not of a site/);
  assert.deepEqual(files(out), ["thesis.txt"]);
  rmSync(out, { recursive: true });
  await writeSite(out, parts);
  write("out/models/thesis.txt", "years of work");
  await assert.rejects(writeSite(out, parts), /thesis\.txt is not of a site/);
  assert.equal(readFileSync(join(out, "models/thesis.txt"), "utf8"), "years of work");
});

test("what an interruption left is replaced, but nothing else of that name", async () => {
  write(`out.partial/${LIST}`, "The files\nindex.html\nmodels/m/model.json\n");
  write("out.partial/index.html", "ha");
  await writeSite(out, parts);
  assert.deepEqual(readdirSync(folder).sort(), ["out", "sources"]);
  write("out.old/thesis.txt", "years of work");
  await assert.rejects(writeSite(out, parts), /out\.old.thesis\.txt/);
  assert.deepEqual(files(join(folder, "out.old")), ["thesis.txt"]);
});

test("without one of its parts no site is begun, and the old one stays", async () => {
  await writeSite(out, parts);
  await assert.rejects(writeSite(out, { ...parts, pkg: join(folder, "absent") }), /ENOENT.*absent/);
  assert.deepEqual(files(out), ["index.html", "models/m/model.json", LIST].sort());
  assert.deepEqual(readdirSync(folder).sort(), ["out", "sources"]);
});
