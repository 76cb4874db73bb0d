import assert from "node:assert/strict";
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, normalize } from "node:path";
import { after, before, test } from "node:test";

import { sectionsOf } from "../../docs-page.mjs";
import { DOORS } from "../../reference.mjs";
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

test("the reference has a page for each name that a door of the package exports", () => {
  for (const [door, file] of Object.entries(DOORS)) {
    const names = [...readFileSync(join(WWW, "types", `${file}.d.ts`), "utf8").matchAll(/^export (?:declare )?(?:class|function|type|const) (\w+)|^export \{ ([^}]+) \}/gm)];
    const exported = names.flatMap(([, one, several]) => (one ? [one] : several.split(",").map((name) => name.trim())));
    assert.ok(exported.length > 0, door);
    const html = readFileSync(join(site, "docs", "api", "modules", `${door.replace("/", "_")}.html`), "utf8");
    for (const name of exported) assert.match(html, new RegExp(`href="\\.\\./(classes|functions|types|variables|interfaces)/[\\w.]*\\b${name}\\.html"`), `${door}: ${name}`);
  }
});

test("code has colours, and each section of each page can be searched for", async () => {
  assert.match(readFileSync(join(site, "docs", "draw.html"), "utf8"), /<span class="hljs-keyword">await<\/span> sft/);
  const sections = JSON.parse(readFileSync(join(site, "docs", "search.json"), "utf8"));
  for (const name of NAMES) assert.ok((await sectionsOf(join(DOCS, name))).length > 0, name);
  for (const { href } of sections) {
    const [page, id] = href.split("#");
    assert.ok(readFileSync(join(site, "docs", page), "utf8").includes(` id="${id}"`), href);
  }
});
