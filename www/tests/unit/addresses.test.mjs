// Addresses with a query, as of a store that signs them: each file of a folder is asked for with it.

import assert from "node:assert/strict";
import { createServer } from "node:http";
import { test } from "node:test";

import { fetchBundle } from "../../src/engine/bundle.js";
import { scanFiles } from "../../src/targets/scan.js";
import { templateSource } from "../../src/targets/target-source.js";

const FILES = {
  "/print/template.json": JSON.stringify({ texture: "a b.png", mesh: "mesh.obj" }),
  "/print/a%20b.png": "texture",
  "/print/mesh.obj": "mesh",
  "/model/model.json": JSON.stringify({ files: { "weights.bpk": { size: 7 } } }),
  "/model/weights.bpk": "weights",
  "/scan.glb": "scan",
};

test("templates, models and scans are fetched from signed addresses", async () => {
  const server = createServer(({ url }, response) => {
    const [path, query] = url.split("?");
    response.statusCode = query === "signed=1" && path in FILES ? 200 : 403;
    response.end(FILES[path]);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const origin = `http://127.0.0.1:${server.address().port}`;
  globalThis.self = { location: { href: `${origin}/page/` } };
  try {
    const { files: template } = await templateSource("../print?signed=1");
    const model = await fetchBundle(new URL("/model/?signed=1", origin), { keep: false });
    const scan = await scanFiles("/scan.glb?signed=1");
    assert.deepEqual([...template.keys()], ["template.json", "a b.png", "mesh.obj"]);
    assert.deepEqual([...model.keys(), ...scan.keys()], ["model.json", "weights.bpk", "scan.glb"]);
  } finally {
    delete globalThis.self;
    server.close();
  }
});
