// The demo page as a folder for any host and any path: the page, the package, the examples with three.js, the models and the documentation.
// `cargo xtask site` builds the package first. By hand:
//
//     node site.mjs DIR

import { copyFile, mkdir, readFile, readdir, realpath, rename, rm, stat, writeFile } from "node:fs/promises";
import { basename, dirname, join, relative, resolve, sep } from "node:path";
import { fileURLToPath } from "node:url";

const www = (name) => fileURLToPath(new URL(name, import.meta.url));

/** What a site is made of, files and folders. */
const PARTS = {
  ...Object.fromEntries(["index.html", "demo", "src", "pkg", "docs", "examples", "LICENSE-APACHE", "LICENSE-MIT"].map((name) => [name, www(name)])),
  models: www("../models"),
  ...Object.fromEntries(
    ["build/three.module.js", "build/three.core.js", "LICENSE"].map((name) => [`three/${basename(name)}`, www(`node_modules/three/${name}`)]),
  ),
};

/** In each site, the names of its other files. */
export const LIST = "site.txt";
const LIST_HEAD = "The files of this site. A folder that holds others is not replaced.";

/** Hidden files, and what git ignores beside the models. */
const LEFT_OUT = /^\.|\.checkpoint|\.tmp$/;

/**
 * Writes a site, or replaces one: beside the folder first, then by renaming, so that the folder always holds a whole site.
 *
 * @param {string} out the folder. It may be absent, empty, or hold a site.
 * @param {Record<string, string>} [parts] files and folders by their names in the site
 * @returns {Promise<string[]>} the names of the files
 * @throws when a part is missing, or a folder that would be replaced holds anything else
 */
export async function writeSite(out, parts = PARTS) {
  const sources = new Map();
  for (const [name, source] of Object.entries(parts)) {
    for (const [file, path] of await filesOf(source)) sources.set(file ? `${name}/${file}` : name, path);
  }
  const folder = await realpath(out).catch(() => resolve(out));
  const [partial, old] = [`${folder}.partial`, `${folder}.old`];
  for (const replaced of [folder, partial, old]) {
    const foreign = await foreignFile(replaced);
    if (foreign) throw new Error(`${join(replaced, foreign)} is not of a site; move it away or choose another folder`);
  }
  await Promise.all([partial, old].map((left) => rm(left, { recursive: true, force: true })));
  await mkdir(partial, { recursive: true });
  // First, so that what an interruption leaves is known to be ours.
  const names = [...sources.keys()].sort();
  await writeFile(join(partial, LIST), [LIST_HEAD, ...names, ""].join("\n"));
  for (const [name, source] of sources) {
    await mkdir(dirname(join(partial, name)), { recursive: true });
    await copyFile(source, join(partial, name));
  }
  await rename(folder, old).catch(ifAbsent);
  await rename(partial, folder);
  await rm(old, { recursive: true, force: true });
  return names;
}

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
