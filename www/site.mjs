// The demo page as a folder for any host and any path: the page, the package, the examples with three.js and A-Frame, the models and the documentation.
// `cargo xtask site` builds the package first. By hand:
//
//     node site.mjs DIR
//
// DEEPSFT_SITE_ADDRESS is the address that the site will have, for the picture beside links to it.

import { createHash } from "node:crypto";
import { copyFile, mkdir, mkdtemp, readFile, readdir, realpath, rename, rm, stat, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { basename, dirname, join, relative, resolve, sep } from "node:path";
import { fileURLToPath } from "node:url";

import { docsPage, sectionsOf } from "./docs-page.mjs";

const www = (name) => fileURLToPath(new URL(name, import.meta.url));

/** What a site is made of, files and folders. */
const PARTS = {
  ...Object.fromEntries(["index.html", "app.webmanifest", "demo", "src", "dist", "pkg/deepsft_web.js", "pkg/THIRD-PARTY.txt", "docs", "examples", "LICENSE-APACHE", "LICENSE-MIT"].map((name) => [name, www(name)])),
  models: www("../models"),
  ...Object.fromEntries(
    ["build/three.module.js", "build/three.core.js", "LICENSE"].map((name) => [`three/${basename(name)}`, www(`node_modules/three/${name}`)]),
  ),
  ...Object.fromEntries(["dist/index.mjs", "LICENSE"].map((name) => [`uqr/${basename(name)}`, www(`node_modules/uqr/${name}`)])),
  ...Object.fromEntries(["dist/aframe-master.module.min.js", "LICENSE"].map((name) => [`aframe/${basename(name)}`, www(`node_modules/aframe/${name}`)])),
};

/** The address of the page's picture for those who show a link to it. */
const PICTURE = /(property="og:image" content=")(?=[^:"]+")/;

/** In each site, the names of its other files. */
export const LIST = "site.txt";
const LIST_HEAD = "The files of this site. A folder that holds others is not replaced.";

/** What runs: the rest is to be read, or to be printed. A model's own list names its files. */
const RUNS = /^(index\.html|app\.webmanifest|(demo|src|examples|three|uqr)\/.*|pkg\/.*\.js|dist\/.*\.wasm|models\/(?!soft-toy\/)[^/]+\/model\.json)$/;
const RUNS_NOT = /LICENSE|screenshot|\.mjs$|^demo\/offline\/(version|service-worker)\.js$/;
const DOCS = /^docs\/[^/]+\.md$/;
const SEARCH = "docs/search.json";
/** A site with this page has the reference of the package beside it, in this folder. */
const [DOCS_INDEX, REFERENCE] = ["docs/index.md", "docs/api"];
const VERSION = "demo/offline/version.js";
const SERVICE_WORKER = "service-worker.js";
const SERVICE_WORKER_SOURCE = `demo/offline/${SERVICE_WORKER}`;

/** Hidden files, and what git ignores beside the models. */
const LEFT_OUT = /^\.|\.checkpoint|\.tmp$/;

/**
 * Writes a site, or replaces one: beside the folder first, then by renaming, so that the folder always holds a whole site.
 *
 * @param {string} out the folder. It may be absent, empty, or hold a site.
 * @param {Record<string, string>} [parts] files and folders by their names in the site
 * @param {string} [address] where the site will be found
 * @returns {Promise<string[]>} the names of the files
 * @throws when a part is missing, or a folder that would be replaced holds anything else
 */
export async function writeSite(out, parts = PARTS, address = process.env.DEEPSFT_SITE_ADDRESS) {
  const made = await mkdtemp(join(tmpdir(), "deepsft-site-"));
  try {
    return await writeSiteWith(made, out, parts, address);
  } finally {
    await rm(made, { recursive: true, force: true });
  }
}

/**
 * three.js comes as it was written, 2.1 MB: a visitor gets a third of that.
 *
 * @param {Map<string, string>} sources changed
 * @param {string} made
 */
async function minifyThree(sources, made) {
  for (const [name, path] of sources) {
    if (!/^three\/.*\.js$/.test(name)) continue;
    // Tests of small sites have no use for it.
    const { transform } = await import("esbuild");
    const { code } = await transform(await readFile(path, "utf8"), { minify: true, format: "esm", legalComments: "inline" });
    const small = join(made, basename(name));
    await writeFile(small, code);
    sources.set(name, small);
  }
}

/**
 * Whoever shows a link with its picture wants the picture's whole address.
 *
 * @param {Map<string, string>} sources changed
 * @param {string} made
 * @param {string} address of the site
 */
async function addressPicture(sources, made, address) {
  const named = join(made, "index.html");
  await writeFile(named, (await readFile(sources.get("index.html"), "utf8")).replace(PICTURE, `$1${address.replace(/\/*$/, "/")}`));
  sources.set("index.html", named);
}

/** @param {string} made an empty folder, for what is made on the way */
async function writeSiteWith(made, out, parts, address) {
  const sources = await sourcesOf(parts);
  if (address) await addressPicture(sources, made, address);
  const reference = join(made, "reference");
  await mkdir(reference);
  await minifyThree(sources, made);
  if (sources.has(DOCS_INDEX)) {
    // TypeScript, which it is made with, is large; the tests have no use for it.
    const { writeReference } = await import("./reference.mjs");
    await writeReference(reference);
    for (const [file, path] of await filesOf(reference)) sources.set(`${REFERENCE}/${file}`, path);
  }
  const written = { ...(await docsPages(sources)), ...(sources.has(SERVICE_WORKER_SOURCE) ? await offlineFiles(sources) : {}) };
  const folder = await realpath(out).catch(() => resolve(out));
  const [partial, old] = [`${folder}.partial`, `${folder}.old`];
  for (const replaced of [folder, partial, old]) {
    const foreign = await foreignFile(replaced);
    if (foreign) throw new Error(`${join(replaced, foreign)} is not of a site; move it away or choose another folder`);
  }
  await Promise.all([partial, old].map((left) => rm(left, { recursive: true, force: true })));
  await mkdir(partial, { recursive: true });
  // First, so that what an interruption leaves is known to be ours.
  const names = [...new Set([...sources.keys(), ...Object.keys(written)])].sort();
  await writeFile(join(partial, LIST), [LIST_HEAD, ...names, ""].join("\n"));
  for (const [name, source] of sources) {
    await mkdir(dirname(join(partial, name)), { recursive: true });
    await copyFile(source, join(partial, name));
  }
  for (const [name, text] of Object.entries(written)) await writeFile(join(partial, name), text);
  await rename(folder, old).catch(ifAbsent);
  await rename(partial, folder);
  await rm(old, { recursive: true, force: true });
  return names;
}

/** The files of a site by their names. @returns {Promise<Map<string, string>>} where each lies */
async function sourcesOf(parts) {
  const sources = new Map();
  for (const [name, source] of Object.entries(parts)) {
    for (const [file, path] of await filesOf(source)) sources.set(file ? `${name}/${file}` : name, path);
  }
  return sources;
}

/** Pages of the documentation by their names, and what their search looks through. @param {Map<string, string>} sources where each file lies */
async function docsPages(sources) {
  const names = [...sources.keys()].filter((name) => DOCS.test(name));
  const page = async (name) => [name.replace(/md$/, "html"), await docsPage(sources.get(name), (other) => sources.has(other))];
  const sections = (await Promise.all(names.sort().map((name) => sectionsOf(sources.get(name))))).flat();
  return { ...Object.fromEntries(await Promise.all(names.map(page))), ...(names.length > 0 && { [SEARCH]: JSON.stringify(sections) }) };
}

/** A page of the documentation as the site has it, or what its search looks through; undefined where there is none. @param {string} name such as "docs/index.html" */
export async function docsPageNamed(name) {
  return name === SEARCH || DOCS.test(name.replace(/html$/, "md")) ? (await docsPages(await sourcesOf(PARTS)))[name] : undefined;
}

/**
 * What a site needs to work offline: the service worker with the hash of each file that runs, and the version of them all.
 *
 * @param {Map<string, string>} [sources] where each file lies
 * @returns {Promise<Record<string, string>>} texts by name
 */
export async function offlineFiles(sources) {
  sources ??= await sourcesOf(PARTS);
  const names = [...sources.keys()].filter((name) => RUNS.test(name) && !RUNS_NOT.test(name));
  for (const name of names.filter((name) => name.endsWith("/model.json"))) {
    const { files } = JSON.parse(await readFile(sources.get(name), "utf8"));
    names.push(...Object.keys(files).map((file) => name.replace(/model.json$/, file)));
  }
  const hashes = await Promise.all(names.sort().map(async (name) => [name, sha256(await readFile(sources.get(name)))]));
  const version = sha256(JSON.stringify(hashes)).slice(0, 16);
  const module = `export const VERSION = "${version}";\n`;
  const site = { version, files: { ...Object.fromEntries(hashes), [VERSION]: sha256(module) } };
  const worker = await readFile(sources.get(SERVICE_WORKER_SOURCE), "utf8");
  return { [VERSION]: module, [SERVICE_WORKER]: `self.SITE = ${JSON.stringify(site)};\n${worker}` };
}

const sha256 = (content) => createHash("sha256").update(content).digest("hex");

/** The files in a folder by their names, with "/"; a file itself has the name "". */
async function filesOf(path) {
  if ((await stat(path)).isFile()) return [["", path]];
  const entries = await readdir(path, { recursive: true, withFileTypes: true });
  const files = entries.filter((entry) => !entry.isDirectory()).map((entry) => join(entry.parentPath ?? entry.path, entry.name));
  const named = files.map((file) => [relative(path, file).split(sep), file]);
  return named.filter(([words]) => !words.some((word) => LEFT_OUT.test(word))).map(([words, file]) => [words.join("/"), file]);
}

/** A file in `folder` that its list does not name. */
async function foreignFile(folder) {
  const entries = (await readdir(folder, { recursive: true, withFileTypes: true }).catch(ifAbsent)) ?? [];
  const list = (await readFile(join(folder, LIST), "utf8").catch(ifAbsent)) ?? "";
  const ours = new Set([LIST, ...list.split("\n").slice(1)]);
  const files = entries.filter((entry) => !entry.isDirectory()).map((entry) => join(entry.parentPath ?? entry.path, entry.name));
  return files.map((file) => relative(folder, file)).find((name) => !ours.has(name.split(sep).join("/")));
}

function ifAbsent(error) {
  if (error.code !== "ENOENT") throw error;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  try {
    const [out] = process.argv.slice(2);
    if (!out) throw new Error("say which folder: node site.mjs DIR");
    const names = await writeSite(out);
    console.log(`${resolve(out)}: ${names.length} files`);
  } catch (error) {
    console.error(`The site cannot be written: ${error.message}`);
    process.exitCode = 1;
  }
}
