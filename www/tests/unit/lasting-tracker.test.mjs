import assert from "node:assert/strict";
import { test } from "node:test";

import { LastingTracker } from "../../src/tracking/lasting-tracker.js";

/** A worker that does what it is told, or dies of it. */
class FakeWorker {
  hasEnded = false;
  /** @param {Set<string>} deadly */
  constructor(deadly) {
    this.deadly = deadly;
  }
  async call(method) {
    if (this.deadly.has(method)) this.terminate();
    if (this.hasEnded) throw new Error("The worker died.");
    return method === "follow" ? { targets: [] } : { effects: [], next: null, answerMs: 1 };
  }
  terminate() {
    this.hasEnded = true;
  }
}

/** @param {string[]} deadly */
function tracker(...deadly) {
  const calls = new Set(deadly);
  const workers = [];
  const create = () => workers[workers.push(new FakeWorker(calls)) - 1];
  const lasting = new LastingTracker(create, () => ({ module: null, targets: [], smooth: null }));
  const start = lasting.start();
  return { lasting, workers, calls, start };
}

/** A frame that finders are asked about, with their answer. */
async function frame({ lasting }) {
  await lasting.follow({ question: { ids: [0], onlyConfirms: false } });
  await lasting.answer({ answers: [] });
}

test("a worker that dies in each answer is replaced twice and then given up", async () => {
  const dying = tracker("answer");
  await dying.start;
  await frame(dying);
  await frame(dying);
  await assert.rejects(frame(dying), /died/);
  assert.equal(dying.workers.length, 3);
});

test("one that dies in each frame that it follows after an answer is given up too", async () => {
  const dying = tracker();
  await dying.start;
  for (let deaths = 0; deaths < 2; deaths++) {
    dying.calls.delete("follow");
    await frame(dying);
    dying.calls.add("follow");
    await dying.lasting.follow({});
  }
  dying.calls.delete("follow");
  await frame(dying);
  dying.calls.add("follow");
  await assert.rejects(dying.lasting.follow({}), /died/);
  assert.equal(dying.workers.length, 3);
});

test("deaths that are far between are borne for ever", async () => {
  const dying = tracker();
  await dying.start;
  for (let deaths = 0; deaths < 5; deaths++) {
    await frame(dying);
    await frame(dying);
    dying.calls.add("answer");
    await frame(dying);
    dying.calls.delete("answer");
  }
  assert.equal(dying.workers.length, 6);
});
