// The programs of www/README.md, those of A-Frame in docs/scene.md, and the page without one of docs/bundlers.md, each on a page of its
// own as it stands there, from dist/ without a bundler, before a camera that shows a picture.

import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import sirv from "sirv";

import { ROOT, WWW } from "../../serve.mjs";

/** The programs by a word that tells which is which. */
const WORDS = { film: "film.mp4", object: "GLTFLoader", measure: "measureSheet" };

export const NAMES = /** @type {const} */ (["film", "object", "measure", "tag", "aframe-film", "aframe-object", "aframe-measure"]);

/** Blocks of a page of the documentation in a language. */
const blocksOf = (name, language) => [...readFileSync(join(WWW, name), "utf8").matchAll(new RegExp(`\`\`\`${language}\\n([\\s\\S]*?)\`\`\``, "g"))].map(([, text]) => text);

/** The pages of A-Frame, in the order of NAMES. @returns {Record<string, string>} */
export function aframePages() {
  const pages = blocksOf("docs/scene.md", "html").filter((text) => text.includes("<a-scene"));
  if (pages.length !== 3) throw new Error(`docs/scene.md has ${pages.length} pages of A-Frame`);
  return Object.fromEntries(NAMES.filter((name) => name.startsWith("aframe")).map((name, index) => [name, pages[index]]));
}

/** The text of each program in README.md. @returns {Record<string, string>} */
export function readmePrograms() {
  const blocks = blocksOf("README.md", "js");
  return Object.fromEntries(
    Object.entries(WORDS).map(([name, word]) => {
      const found = blocks.filter((text) => text.includes(word));
      if (found.length !== 1) throw new Error(`README.md has ${found.length} programs with ${word}`);
      return [name, found[0]];
    }),
  );
}

/** Beside the programs; the film is coded so that each engine here plays it. */
const TYPES = { html: "text/html", png: "image/png", jpg: "image/png", mp4: "video/webm", glb: "model/gltf-binary" };

/** Of docs/bundlers.md: an element that needs no script, and the import map for programs. */
const [TAG, IMPORT_MAP] = blocksOf("docs/bundlers.md", "html");

const HEAD = `<!doctype html>
<meta charset="utf-8" />
<link rel="icon" href="data:," />
<script>(${showPicture})()</script>
<style>body { margin: 0 } #ar, deepsft-view, body a-scene { width: 640px; height: 360px }</style>`;

/** A page with a program, in a part of it of 640 x 360 pixels. */
const pageOf = (program) => `${HEAD}
${IMPORT_MAP}
<div id="ar"></div>
<video playsinline muted width="1" height="1"></video>
<script type="module">${program}</script>`;

/** On the page: its camera shows a picture, for no browser but Chromium shows a file as one. */
function showPicture() {
  const canvas = Object.assign(document.createElement("canvas"), { width: 960, height: 540 });
  const picture = Object.assign(new Image(), { src: "camera.png" });
  setInterval(() => picture.complete && canvas.getContext("2d").drawImage(picture, 0, 0, 960, 540), 60);
  const tracks = (globalThis.tracks = []);
  globalThis.errors = [];
  addEventListener("error", ({ message }) => errors.push(message));
  addEventListener("unhandledrejection", ({ reason }) => errors.push(String(reason)));
  const open = async () => {
    const stream = canvas.captureStream(15);
    tracks.push(...stream.getTracks());
    return stream;
  };
  // Of the one object WebKit forgets what is added to it.
  MediaDevices.prototype.getUserMedia = open;
}

/**
 * Serves the programs with the files they name.
 *
 * @param {Record<string, Buffer>} files by their names in the programs; `camera.png` is what the camera shows
 */
export async function servePrograms(files) {
  const programs = readmePrograms();
  const pages = { ...aframePages(), tag: TAG };
  const places = [
    ["/deepsft/", sirv(join(WWW, "dist"), { dev: true })],
    ["/aframe/", sirv(join(WWW, "node_modules", "aframe", "dist"), { dev: true })],
    ["/three/", sirv(join(WWW, "node_modules", "three"), { dev: true })],
    ["/models/", sirv(join(ROOT, "models"), { dev: true })],
    ["/", sirv(WWW, { dev: true })],
  ];
  const server = createServer((request, response) => {
    const [, name, ending] = /^\/program\/([\w-]+\.(\w+))/.exec(request.url) ?? [];
    if (name) {
      const [page, program] = [pages, programs].map((all) => all[name.replace(".html", "")]);
      const content = page ? HEAD + page : program ? pageOf(program) : files[name];
      return response.writeHead(content ? 200 : 404, { "content-type": TYPES[ending] }).end(content);
    }
    const [prefix, answer] = places.find(([prefix]) => request.url.startsWith(prefix));
    request.url = `/${request.url.slice(prefix.length)}`;
    answer(request, response);
  });
  server.keepAliveTimeout = 0;
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return {
    origin: `http://localhost:${server.address().port}`,
    close: () => new Promise((resolve) => (server.closeAllConnections(), server.close(resolve))),
  };
}

/** A box of glTF that turns about its upright axis once a second, `size` metres large, standing on the ground. @returns {Buffer} */
export function turningBox(size) {
  const faces = [0, 1, 2].flatMap((axis) => [-1, 1].map((side) => ({ axis, side })));
  const corner = ({ axis, side }, a, b) => [0, 1, 2].map((k) => (k === axis ? side : k === (axis + 1) % 3 ? a * side : b));
  const points = faces.flatMap((face) => [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].map(([a, b]) => corner(face, a, b)));
  const positions = points.flatMap(([x, y, z]) => [(x * size) / 2, ((y + 1) * size) / 2, (z * size) / 2]);
  const normals = faces.flatMap(({ axis, side }) => Array.from({ length: 6 }, () => [0, 1, 2].map((k) => (k === axis ? side : 0))).flat());
  const times = [0, 0.5, 1];
  const turns = [[0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, -1]].flat();
  const arrays = [positions, normals, times, turns];
  const bytes = Buffer.from(Float32Array.from(arrays.flat()).buffer);
  let at = 0;
  const bufferViews = arrays.map((array) => ({ buffer: 0, byteOffset: (at += 4 * array.length) - 4 * array.length, byteLength: 4 * array.length }));
  const accessor = (bufferView, count, type, more) => ({ bufferView, componentType: 5126, count, type, ...more });
  return Buffer.from(
    JSON.stringify({
      asset: { version: "2.0" },
      scene: 0,
      scenes: [{ nodes: [0] }],
      nodes: [{ mesh: 0 }],
      materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.9, 0.05, 0.4, 1], metallicFactor: 0, roughnessFactor: 0.6 } }],
      meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, material: 0 }] }],
      animations: [{ channels: [{ sampler: 0, target: { node: 0, path: "rotation" } }], samplers: [{ input: 2, output: 3 }] }],
      accessors: [
        accessor(0, 36, "VEC3", { min: [-size / 2, 0, -size / 2], max: [size / 2, size, size / 2] }),
        accessor(1, 36, "VEC3"),
        accessor(2, 3, "SCALAR", { min: [0], max: [1] }),
        accessor(3, 3, "VEC4"),
      ],
      bufferViews,
      buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString("base64")}` }],
    }),
  );
}
