import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { request } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { WWW, serve } from "../../serve.mjs";

let folder;
let server;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "deepsft-serve-"));
  for (const [name, text] of Object.entries({
    "www/index.html": "<p>page",
    "www/a b.js": "0123456789",
    "www/x.wasm": "\0asm",
    "www/.hidden": "secret",
    "models/m/model.json": "{}",
    "secret.txt": "secret",
  })) {
    mkdirSync(join(folder, name, ".."), { recursive: true });
    writeFileSync(join(folder, name), text);
  }
  server = await serve({ folders: { "/models/": join(folder, "models"), "/": join(folder, "www") } });
});
after(async () => {
  await server.close();
  rmSync(folder, { recursive: true, force: true });
});

/** The answer to a path as it is, dots and all. */
function get(path, headers = {}) {
  return new Promise((resolve, reject) => {
    const { port } = new URL(server.origin);
    request({ host: "127.0.0.1", port, path, headers }, (response) => {
      let text = "";
      response.on("data", (chunk) => (text += chunk));
      response.on("end", () => resolve({ status: response.statusCode, headers: response.headers, text }));
    })
      .on("error", reject)
      .end();
  });
}

test("pages, scripts, modules and models are served with their types", async () => {
  const page = await get("/");
  assert.deepEqual([page.status, page.text], [200, "<p>page"]);
  assert.match(page.headers["content-type"], /^text\/html/);
  assert.match((await get("/a%20b.js?v=1")).headers["content-type"], /javascript/);
  assert.equal((await get("/x.wasm")).headers["content-type"], "application/wasm");
  assert.equal((await get("/models/m/model.json")).text, "{}");
});

test("what a browser has already is not sent again", async () => {
  const { etag } = (await get("/x.wasm")).headers;
  assert.equal((await get("/x.wasm", { "if-none-match": etag })).status, 304);
});

test("a video player gets the bytes it asks for", async () => {
  const middle = await get("/a%20b.js", { range: "bytes=2-4" });
  assert.deepEqual([middle.status, middle.headers["content-range"], middle.text], [206, "bytes 2-4/10", "234"]);
});

test("nothing outside of the folders, and nothing hidden, is served", async () => {
  for (const path of [
    "/../secret.txt",
    "/%2e%2e/secret.txt",
    "/models/../secret.txt",
    "/models/..%2fsecret.txt",
    "/models//../../secret.txt",
    "//etc/passwd",
    "/.hidden",
    "/%2ehidden",
    "/%",
    "/absent",
  ]) {
    const { status, text } = await get(path);
    assert.equal(status, 404, path);
    assert.doesNotMatch(text, /secret/, path);
  }
});

test("a port that is taken is an error in words", () => {
  const { port } = new URL(server.origin);
  const { status, stderr } = spawnSync(process.execPath, [join(WWW, "serve.mjs"), port], { encoding: "utf8" });
  assert.equal(status, 1);
  assert.match(stderr, new RegExp(`on port ${port}: .*EADDRINUSE`));
});
