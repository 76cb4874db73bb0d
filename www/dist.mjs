// The package for pages without a bundler, and for bundlers that do not find its worker: one minified module for each door of the package,
// one script for the worker, and the engine, in one folder, dist/. `cargo xtask web` calls it after it has built the engine. By hand:
//
//     node dist.mjs

import { build } from "esbuild";
import { copyFile, readFile, rename, rm, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { fileURLToPath } from "node:url";

const www = (name) => fileURLToPath(new URL(name, import.meta.url));

const OUT = www("dist");
const ENGINE = "pkg/deepsft_web_bg.wasm";

/** Modules that share what they have in common, so that a page may import several. three.js is the page's own. */
const DOORS = { deepsft: "src/index.js", light: "src/light/index.js", three: "src/three/index.js", scene: "src/scene/index.js" };

/** Addresses that the sources have from their own folders, by the ends of their files' names; here all files lie in one. */
const ADDRESSES = {
  "src/deepsft.js": ["../dist/deepsft_web_bg.wasm", "./deepsft_web_bg.wasm"],
  "src/engine/worker-calls.js": ["../worker.js", "./worker.js"],
};

const inOneFolder = {
  name: "in-one-folder",
  setup({ onLoad }) {
    onLoad({ filter: /src[\\/](deepsft|engine[\\/]worker-calls)\.js$/ }, async ({ path }) => {
      const [, [from, to]] = Object.entries(ADDRESSES).find(([end]) => path.replaceAll("\\", "/").endsWith(end));
      const source = await readFile(path, "utf8");
      const parts = source.split(`new URL("${from}", import.meta.url)`);
      if (parts.length !== 2) throw new Error(`${path} has the address ${from} ${parts.length - 1} times, not once`);
      return { contents: parts.join(`new URL("${to}", import.meta.url)`) };
    });
  },
};

/** A-Frame's script has three.js in it, and two of them know nothing of each other's objects. */
const threeOfAframe = {
  name: "three-of-aframe",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^three$/ }, () => ({ path: "three", namespace: "aframe" }));
    onLoad({ filter: /.*/, namespace: "aframe" }, () => ({
      contents: 'if (!globalThis.AFRAME) throw new Error("A-Frame is not there: its script comes before that of deepsft."); module.exports = AFRAME.THREE;',
    }));
  },
};

/** Writes the folder aside and renames it: it is never half there. */
export async function writeDist() {
  const partial = `${OUT}.tmp`;
  await rm(partial, { recursive: true, force: true });
  const options = { bundle: true, minify: true, format: "esm", target: "es2022", outdir: partial, plugins: [inOneFolder], legalComments: "eof", logLevel: "warning" };
  const absolute = (doors) => Object.fromEntries(Object.entries(doors).map(([name, file]) => [name, www(file)]));
  await build({ ...options, entryPoints: absolute(DOORS), splitting: true, chunkNames: "shared-[hash]", external: ["three"] });
  // With all that it needs: a page that has it writes no script at all.
  await build({ ...options, entryPoints: absolute({ element: "src/scene/element.js", worker: "src/worker.js" }) });
  await build({ ...options, entryPoints: absolute({ aframe: "src/scene/aframe.js" }), plugins: [inOneFolder, threeOfAframe] });
  await copyFile(www(ENGINE), join(partial, basename(ENGINE)));
  // Whoever copies the folder copies the licences of what is in it.
  const licences = await Promise.all([www("pkg/THIRD-PARTY.txt"), www("node_modules/three/LICENSE")].map((path) => readFile(path, "utf8")));
  await writeFile(join(partial, "THIRD-PARTY.txt"), licences.join("\n\nthree.js, in element.js\n\n"));
  await rm(OUT, { recursive: true, force: true });
  await rename(partial, OUT);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) await writeDist();
