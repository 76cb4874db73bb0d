// Images that a page names or that still load; what browsers decode is in tests/browser.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { unlessAborted } from "../../src/abort.js";
import { readImage, transferableFrame } from "../../src/frames/image-input.js";

const { fetch } = globalThis;
beforeEach(() => {
  globalThis.document = { baseURI: "http://host/page/" };
  globalThis.ImageData ??= class {};
});
afterEach(() => {
  globalThis.fetch = fetch;
  for (const name of ["document", "HTMLImageElement", "createImageBitmap"]) delete globalThis[name];
});

test("an address is fetched relative to the page; where nothing is to be had the error names it", async () => {
  const asked = [];
  globalThis.fetch = async (url) => {
    asked.push(url.href);
    return new Response("bytes", { status: url.href.endsWith(".jpg") ? 200 : 404 });
  };
  assert.equal(await (await readImage("poster.jpg")).text(), "bytes");
  assert.equal(await (await readImage(new URL("http://other/b.jpg"))).text(), "bytes");
  assert.deepEqual(asked, ["http://host/page/poster.jpg", "http://other/b.jpg"]);
  await assert.rejects(readImage("none.png"), ({ code, message }) => code === "image-unreadable" && /host\/page\/none\.png .*404/.test(message));
  globalThis.fetch = () => Promise.reject(new TypeError("offline"));
  await assert.rejects(readImage("poster.jpg"), { name: "DeepSftError", code: "image-unreadable" });
  const picture = new Blob(["as it is"]);
  assert.equal(await readImage(picture), picture);
});

test("an image element that still loads is waited for", async () => {
  let loaded;
  globalThis.HTMLImageElement = class {
    complete = false;
    decode = () => new Promise((resolve) => (loaded = () => ((this.complete = true), resolve())));
  };
  globalThis.createImageBitmap = async ({ complete }) => {
    if (!complete) throw new DOMException("", "InvalidStateError");
    return { width: 4, height: 3 };
  };
  const reading = transferableFrame(new HTMLImageElement());
  setTimeout(() => loaded(), 5);
  assert.deepEqual(await reading, { frame: { width: 4, height: 3 }, width: 4, height: 3 });
  const broken = new HTMLImageElement();
  broken.decode = () => Promise.reject(new DOMException("", "EncodingError"));
  await assert.rejects(transferableFrame(broken), { code: "image-unreadable" });
});

test("an aborted signal rejects at once with its reason, and what comes after that is let go", async () => {
  const leaving = new AbortController();
  const late = [];
  let finish;
  const waiting = unlessAborted(new Promise((resolve) => (finish = resolve)), leaving.signal, (one) => late.push(one));
  leaving.abort(new Error("left"));
  await assert.rejects(waiting, /left/);
  finish("estimate");
  await new Promise(setImmediate);
  assert.deepEqual(late, ["estimate"]);
  await assert.rejects(readImage("poster.jpg", leaving.signal), /left/);
  assert.equal(await unlessAborted(Promise.resolve(7), undefined), 7);
  assert.equal(await unlessAborted(Promise.resolve(7), new AbortController().signal), 7);
});
