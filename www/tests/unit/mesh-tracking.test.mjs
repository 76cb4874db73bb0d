import assert from "node:assert/strict";
import { test } from "node:test";
import { setTimeout as wait } from "node:timers/promises";

import { MeshTracking } from "../../src/tracking/mesh-tracking.js";

globalThis.ImageData ??= class {};
globalThis.ImageBitmap ??= class {
  width = 480;
  height = 270;
  close() {}
};
globalThis.createImageBitmap ??= async () => new ImageBitmap();

/** A video whose frames the test shows. */
class FakeVideo extends EventTarget {
  #shown = () => undefined;
  requestVideoFrameCallback(callback) {
    this.#shown = callback;
  }
  show(presentationTime) {
    this.#shown(0, { presentationTime });
  }
}

test("the last frame of a clip is told, though one that came too soon after it waits", async () => {
  const video = new FakeVideo();
  const [told, followed] = [[], []];
  const target = { id: 0, mesh: null };
  const next = { focal: 380, intervalMs: 60_000, question: null };
  const times = { warpMs: 0, trackMs: 0 };
  const tracking = new MeshTracking(video, {
    targets: [target],
    tracker: {
      start: async () => undefined,
      follow: () => new Promise((resolve) => followed.push(() => resolve({ targets: [], afresh: true, focal: null, next, times, readMs: 0 }))),
      answer: async () => ({ effects: [], next: null, answerMs: 0 }),
      terminate: () => undefined,
    },
    find: async () => ({ answers: [], estimate: null }),
    onTracked: (tracked) => told.push(tracked.number),
  });
  video.show(10);
  await wait(5);
  assert.equal(followed.length, 1);
  video.show(20);
  followed[0]();
  await wait(5);
  assert.deepEqual(told, [1]);
  assert.equal(followed.length, 1, "a frame that comes too soon is not worth its time");
  tracking.stop();
  await tracking.finished;
});
