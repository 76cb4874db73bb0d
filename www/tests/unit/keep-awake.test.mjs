import assert from "node:assert/strict";
import { getEventListeners } from "node:events";
import { test } from "node:test";

import { keepAwake } from "../../demo/live/keep-awake.js";

test("a page that is hidden and shown again holds one lock of the screen, and lets it go in the end", async () => {
  const held = new Set();
  const request = async () => {
    const lock = { release: async () => void held.delete(lock) };
    held.add(lock);
    return lock;
  };
  Object.defineProperty(globalThis, "navigator", { value: { wakeLock: { request } }, configurable: true });
  const page = Object.assign(new EventTarget(), { visibilityState: "visible" });
  globalThis.document = page;
  const ended = new AbortController();
  keepAwake(ended.signal);
  for (const visibilityState of ["hidden", "visible", "hidden", "visible"]) {
    Object.assign(page, { visibilityState }).dispatchEvent(new Event("visibilitychange"));
    await new Promise(setImmediate);
  }
  assert.equal(held.size, 1);
  // Of the two listeners on the page and its own, one each.
  assert.equal(getEventListeners(ended.signal, "abort").length, 2);
  ended.abort();
  await new Promise(setImmediate);
  assert.equal(held.size, 0);
});
