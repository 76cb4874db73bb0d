// What the browser keeps of models that lie in one another's folders; the real storage is in tests/browser.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { fetchBundle } from "../../src/engine/bundle.js";

const sha256 = async (bytes) => Buffer.from(await crypto.subtle.digest("SHA-256", bytes)).toString("hex");

let kept;
let served;
let asked;
beforeEach(() => {
  [kept, served, asked] = [new Map(), new Map(), []];
  globalThis.caches = {
    open: async () => ({
      match: async (key) => kept.get(key)?.clone(),
      put: async (key, response) => void kept.set(key, response),
      delete: async (key) => kept.delete(key),
      keys: async () => [...kept.keys()].map((url) => ({ url })),
    }),
  };
  globalThis.fetch = async (url) => {
    asked.push(String(url));
    const { pathname, search } = new URL(url);
    return served.has(pathname) && search === "?token=1" ? new Response(served.get(pathname)) : new Response("", { status: 404 });
  };
});
const { fetch } = globalThis;
afterEach(() => {
  delete globalThis.caches;
  globalThis.fetch = fetch;
});

/** Puts a model on the server. */
async function serve(folder, contents) {
  const files = {};
  for (const [name, content] of Object.entries(contents)) {
    const bytes = new TextEncoder().encode(content);
    served.set(folder + name, bytes);
    files[name] = { size: bytes.length, sha256: await sha256(bytes) };
  }
  served.set(`${folder}model.json`, JSON.stringify({ files }));
}
const load = (folder) => fetchBundle(new URL(`http://host${folder}?token=1`));
const names = () => [...kept.keys()].map((url) => new URL(url).pathname).sort();

test("a model in a folder leaves those in folders below it alone, and drops its own old files", async () => {
  await serve("/poster/v2/", { "weights.bpk": "two", "template/texture.png": "t2" });
  await serve("/poster/", { "weights.bpk": "one", "old.bpk": "old", "template/texture.png": "t1" });
  await load("/poster/v2/");
  await load("/poster/");
  await serve("/poster/", { "weights.bpk": "newer", "template/texture.png": "t1" });
  await load("/poster/");
  assert.deepEqual(names(), ["/poster/template/texture.png", "/poster/v2/template/texture.png", "/poster/v2/weights.bpk", "/poster/weights.bpk"]);
});

test("the query of a model's address goes with each of its files", async () => {
  await serve("/poster/", { "weights.bpk": "one" });
  assert.deepEqual([...(await load("/poster/")).keys()], ["model.json", "weights.bpk"]);
  assert.deepEqual(asked, ["http://host/poster/model.json?token=1", "http://host/poster/weights.bpk?token=1"]);
});
