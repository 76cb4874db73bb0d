import assert from "node:assert/strict";
import { test } from "node:test";

import { DeepSftError } from "../../src/error.js";
import { Patience } from "../../src/frames/patience.js";
import { VideoFrames } from "../../src/frames/video-frames.js";

/** A video whose frames the test shows. */
class FakeVideo extends EventTarget {
  #callbacks = [];
  requestVideoFrameCallback(callback) {
    this.#callbacks.push(callback);
  }
  show(presentationTime) {
    for (const callback of this.#callbacks.splice(0)) callback(0, { presentationTime });
  }
  get listeners() {
    return this.#callbacks.length;
  }
}

/** The frames of a video, which `stop` ends. */
function framesOf(video) {
  const stopping = new AbortController();
  return Object.assign(new VideoFrames(video, stopping.signal), { stop: () => stopping.abort() });
}

test("a frame that was shown before it was asked for is given at once, the newest one only", async () => {
  const video = new FakeVideo();
  const frames = framesOf(video);
  video.show(10);
  video.show(20);
  assert.equal(await frames.next(), 20);
  const waiting = frames.next();
  video.show(30);
  assert.equal(await waiting, 30);
});

test("a frame is given once", async () => {
  const video = new FakeVideo();
  const frames = framesOf(video);
  video.show(10);
  await frames.next();
  let answered = false;
  void frames.next().then(() => (answered = true));
  await new Promise((resolve) => setTimeout(resolve, 5));
  assert.equal(answered, false);
});

test("it counts how often the video plays something else, whose frames alone are given then", async () => {
  const video = new FakeVideo();
  const frames = framesOf(video);
  video.show(10);
  video.dispatchEvent(new Event("emptied"));
  assert.deepEqual([frames.changes, frames.waiting], [1, false]);
  video.show(20);
  assert.equal(await frames.next(), 20);
  frames.stop();
  video.dispatchEvent(new Event("emptied"));
  assert.equal(frames.changes, 1);
});

test("stopping ends the wait, and the video is listened to no more", async () => {
  const video = new FakeVideo();
  const frames = framesOf(video);
  const waiting = frames.next();
  frames.stop();
  assert.equal(await waiting, null);
  video.show(10);
  assert.equal(video.listeners, 0);
  assert.equal(await frames.next(), null);
});

test("it says whether a frame waits, and when one last went by untaken", async () => {
  const video = new FakeVideo();
  const frames = framesOf(video);
  assert.equal(frames.waiting, false);
  video.show(10);
  assert.deepEqual([frames.waiting, frames.missedAt], [true, -Infinity]);
  video.show(20);
  video.show(30);
  assert.equal(await frames.next(), 30);
  assert.deepEqual([frames.waiting, frames.missedAt], [false, 30]);
  video.show(40);
  await frames.next();
  assert.equal(frames.missedAt, 30);
});

test("where the browser does not tell, a picture that stays, as of a paused video, is taken once", async (t) => {
  const screen = [];
  globalThis.requestAnimationFrame = (callback) => screen.push(callback);
  t.after(() => delete globalThis.requestAnimationFrame);
  const refresh = (at) => screen.splice(0).forEach((callback) => callback(at));
  const video = Object.assign(new EventTarget(), { readyState: 0, HAVE_CURRENT_DATA: 2, currentTime: 0 });
  const frames = framesOf(video);
  refresh(10);
  assert.equal(frames.waiting, false, "it has no picture yet");
  video.readyState = 4;
  for (const at of [20, 30, 40]) refresh(at);
  assert.deepEqual([await frames.next(), frames.waiting, frames.missedAt], [20, false, -Infinity]);
  video.currentTime = 0.04;
  refresh(50);
  assert.equal(await frames.next(), 50);
  video.getVideoPlaybackQuality = () => ({ totalVideoFrames: 7 });
  for (const at of [60, 70]) {
    refresh(at);
    video.currentTime += 0.01;
  }
  assert.deepEqual([await frames.next(), frames.waiting, frames.missedAt], [60, false, -Infinity]);
  frames.stop();
  refresh(80);
  assert.equal(screen.length, 0);
});

test("frames that cannot be read are borne, other errors are not, and neither are failures without end", (t) => {
  t.mock.timers.enable({ apis: ["Date"] });
  const clock = t.mock.method(performance, "now", () => Date.now());
  const unreadable = new DeepSftError("image-unreadable", "");
  const patience = new Patience();
  for (let i = 0; i < 10; i++) patience.bear(unreadable);
  t.mock.timers.tick(60_000);
  patience.reset();
  for (let i = 0; i < 20; i++) patience.bear(unreadable);
  t.mock.timers.tick(60_000);
  assert.throws(() => patience.bear(unreadable), { code: "image-unreadable" });
  patience.reset();
  assert.throws(() => patience.bear(new DeepSftError("closed", "")), { code: "closed" });
  clock.mock.restore();
});
