import assert from "node:assert/strict";
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, normalize } from "node:path";
import { after, before, test } from "node:test";

import { WWW } from "../../serve.mjs";
import { writeSite } from "../../site.mjs";

const DOCS = join(WWW, "docs");
const NAMES = readdirSync(DOCS).filter((name) => name.endsWith(".md"));

let site;
before(async () => {
  site = mkdtempSync(join(tmpdir(), "deepsft-docs-"));
  await writeSite(site, Object.fromEntries(["docs", "examples", "demo", "index.html"].map((name) => [name, join(WWW, name)])));
});
after(() => rmSync(site, { recursive: true, force: true }));

test("each link of the documentation leads to a file of the repository", () => {
  for (const name of NAMES) {
    const links = [...readFileSync(join(DOCS, name), "utf8").matchAll(/\]\(([^)#\s]+)(?:#[^)]*)?\)/g)].map(([, link]) => link);
    for (const link of links.filter((link) => !/^\w+:/.test(link))) assert.ok(existsSync(join(DOCS, link)), `${name}: ${link}`);
  }
});

test("each page is on the site as HTML, and its links and headings are there", () => {
  const html = (name) => readFileSync(join(site, name), "utf8");
  for (const name of NAMES.map((name) => `docs/${name.replace("md", "html")}`)) {
    const links = [...html(name).matchAll(/(?:href|src)="([^"]+)"/g)].map(([, link]) => link);
    assert.ok(links.length > 1);
    for (const link of links.filter((link) => !/^\w+:/.test(link))) {
      const [path, hash] = link.split("#");
      const target = path === "" ? name : normalize(join(dirname(name), path));
      const file = target.endsWith("/") || target === "." ? join(target, "index.html") : target;
      assert.ok(existsSync(join(site, file)), `${name}: ${link}`);
      if (hash && file.endsWith(".html")) assert.ok(html(file).includes(`id="${hash}"`), `${name}: ${link}`);
      assert.ok(!link.includes(".md"), `${name}: ${link}`);
    }
  }
});

test("the list of pages names them all", () => {
  const index = readFileSync(join(DOCS, "index.md"), "utf8");
  for (const name of NAMES.filter((name) => name !== "index.md")) assert.ok(index.includes(`(${name}`), name);
});
