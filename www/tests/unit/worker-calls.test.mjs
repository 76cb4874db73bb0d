import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { WWW } from "../../serve.mjs";
import { WorkerCalls } from "../../src/engine/worker-calls.js";
import { VERSION } from "../../src/version.js";

/** A worker that answers while it lives. */
class FakeWorker extends EventTarget {
  static newest;
  alive = true;
  constructor() {
    super();
    FakeWorker.newest = this;
  }
  postMessage({ id }) {
    if (this.alive) queueMicrotask(() => this.dispatchEvent(Object.assign(new Event("message"), { data: { id, value: id } })));
  }
  terminate() {}
}

test("a worker that was killed is noticed after some 20 s where it has answered the like before, else only after the time allowed", async (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  globalThis.Worker = FakeWorker;
  t.after(() => delete globalThis.Worker);
  const calls = new WorkerCalls(new URL("http://host/worker.js"));
  await calls.call("follow", {});
  FakeWorker.newest.alive = false;
  const [known, unknown] = [calls.call("follow", {}), calls.call("estimate", {})];
  for (const call of [known, unknown]) call.catch(() => undefined);
  t.mock.timers.tick(60_000);
  assert.equal(calls.hasEnded, false, "its first estimate may take minutes");
  t.mock.timers.tick(122_000);
  await assert.rejects(unknown, { code: "internal" });

  const other = new WorkerCalls(new URL("http://host/worker.js"));
  await other.call("follow", {});
  FakeWorker.newest.alive = false;
  const lost = other.call("follow", {});
  t.mock.timers.tick(15_000);
  assert.equal(other.hasEnded, false);
  t.mock.timers.tick(8000);
  await assert.rejects(lost, /silent for 20 s/);
});

test("the version that page and worker compare is that of the package", () => {
  assert.equal(VERSION, JSON.parse(readFileSync(join(WWW, "package.json"), "utf8")).version);
});
