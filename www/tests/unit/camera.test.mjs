// openCamera against getUserMedia stand-ins that refuse as browsers do; the real thing is in tests/browser.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";

import { PAPER_CAMERAS, openCamera } from "deepsft";
import { Stream, Video, page, phone, refusal, told, withDevices } from "../support/fake-camera.mjs";

for (const [name, code] of [
  ["NotAllowedError", "camera-denied"],
  ["NotFoundError", "camera-not-found"],
  ["NotReadableError", "camera-busy"],
  ["AbortError", "camera-busy"],
  ["SecurityError", "insecure-context"],
  ["OverconstrainedError", "camera-constraints"],
  ["TypeError", "internal"],
]) {
  test(`${name} becomes ${code}`, async () => {
    const enumerateDevices = async () => [{ kind: "videoinput" }];
    withDevices({ getUserMedia: () => Promise.reject(refusal(name)), enumerateDevices });
    await assert.rejects(openCamera(new Video()), { name: "DeepSftError", code });
  });
}

test("a camera that does not fit because there is none is not found", async () => {
  const enumerateDevices = async () => [{ kind: "audioinput" }];
  withDevices({ getUserMedia: () => Promise.reject(refusal("OverconstrainedError")), enumerateDevices });
  await assert.rejects(openCamera(new Video()), { code: "camera-not-found" });
});

test("a page without mediaDevices is told that its address is not secure, or, where it is, that the browser has none", async () => {
  withDevices(undefined);
  await assert.rejects(openCamera(new Video()), { code: "insecure-context" });
  self.isSecureContext = true;
  await assert.rejects(openCamera(new Video()), { code: "camera-unsupported" });
});

test("a refusal by a policy is told from one by the person, and neither speaks of an address bar", async () => {
  withDevices({ getUserMedia: () => Promise.reject(refusal("NotAllowedError")) });
  await assert.rejects(openCamera(new Video()), ({ code, message }) => code === "camera-denied" && !message.includes("address bar"));
  page.featurePolicy = { allowsFeature: (name) => name !== "camera" };
  await assert.rejects(openCamera(new Video()), { code: "camera-blocked" });
});

/** Lets all promises go on that wait for nothing else. */
const settle = () => new Promise((resolve) => setImmediate(resolve));

test("an opening that is aborted rejects at once, and a camera that is allowed after that is freed", async () => {
  const stream = new Stream();
  let allow;
  withDevices({ getUserMedia: () => new Promise((resolve) => (allow = () => resolve(stream))), enumerateDevices: async () => [] });
  const leaving = new AbortController();
  const video = new Video();
  const opening = openCamera(video, { signal: leaving.signal });
  await settle();
  leaving.abort(new Error("left"));
  await assert.rejects(opening, /left/);
  allow();
  await settle();
  assert.deepEqual([stream.track.readyState, video.srcObject], ["ended", null]);
  await assert.rejects(openCamera(video, { signal: leaving.signal }), /left/);
});

test("an abort while the camera starts, and after that, stops it", async () => {
  const stream = new Stream();
  withDevices({ getUserMedia: async () => stream, enumerateDevices: async () => [] });
  const [starting, playing] = [new AbortController(), new AbortController()];
  const silent = new Video();
  silent.play = async () => undefined;
  const opening = openCamera(silent, { signal: starting.signal });
  await settle();
  starting.abort();
  await assert.rejects(opening, { name: "AbortError" });
  assert.equal(stream.track.readyState, "ended");
  stream.track.readyState = "live";
  const video = new Video();
  const camera = await openCamera(video, { signal: playing.signal });
  playing.abort();
  assert.deepEqual([stream.track.readyState, video.srcObject, camera.signal.aborted, camera.error], ["ended", null, true, null]);
});

test("a camera that is muted from the start is interrupted until it is unmuted; one that gives nothing is refused", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const stream = new Stream();
  stream.track.muted = true;
  withDevices({ getUserMedia: async () => stream, enumerateDevices: async () => [] });
  const video = new Video();
  video.play = async () => undefined;
  const opening = openCamera(video);
  await settle();
  t.mock.timers.tick(3000);
  const camera = await opening;
  assert.equal(camera.interrupted, true);
  const resumed = told(camera, "resumed");
  stream.track.mute(false);
  await resumed;
  assert.equal(camera.interrupted, false);

  const nothing = openCamera(video);
  nothing.catch(() => undefined);
  await settle();
  t.mock.timers.tick(10_000);
  await assert.rejects(nothing, { code: "camera-busy" });
  assert.equal(stream.track.readyState, "ended");
});

test("a play() that is interrupted is no busy camera: it plays all the same, or something else took its video", async () => {
  withDevices({ getUserMedia: async () => new Stream(), enumerateDevices: async () => [] });
  const video = new Video();
  const interrupted = (then) => async () => {
    queueMicrotask(then);
    throw refusal("AbortError");
  };
  video.play = interrupted(() => video.dispatchEvent(new Event("loadeddata")));
  assert.equal((await openCamera(video)).error, null);
  video.play = async () => {
    video.srcObject = new Stream();
    throw refusal("AbortError");
  };
  await assert.rejects(openCamera(video), { code: "closed" });
  assert.equal(video.srcObject.track.readyState, "live", "what took its place plays on");
  video.play = () => Promise.reject(refusal("NotAllowedError"));
  await assert.rejects(openCamera(video), { code: "play-refused" });
  video.play = () => Promise.reject(new TypeError("a defect"));
  await assert.rejects(openCamera(video), { code: "internal" });
});

test("a camera that another program had while the page was away is asked for again, and lost with its reason where that goes on", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  let busy = 0;
  const { opened } = phone({ refuse: () => busy-- > 0 });
  const camera = await openCamera(new Video());
  const away = async (times) => {
    page.show(false);
    opened.at(-1).track.end();
    busy = times;
    page.show(true);
    for (let i = 0; i < 5; i++) {
      await settle();
      t.mock.timers.tick(3000);
    }
  };
  await away(3);
  assert.deepEqual([camera.error, camera.interrupted, opened.length], [null, false, 2]);
  await away(4);
  assert.deepEqual([camera.error?.code, camera.error?.cause?.code], ["camera-lost", "camera-busy"]);
  assert.match(camera.error.message, /another program/);
});

test("constraints that cannot be met are relaxed in three steps, other refusals end at once", async () => {
  const asked = [];
  withDevices({
    getUserMedia: async ({ video }) => {
      asked.push(video);
      if (asked.length < 3) throw refusal("OverconstrainedError");
      return new Stream();
    },
    enumerateDevices: async () => [],
  });
  await openCamera(new Video(), { deviceId: "usb" });
  assert.deepEqual(asked, [
    { deviceId: { exact: "usb" }, width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } },
    { deviceId: { exact: "usb" } },
    // It is not there any more: any that looks away.
    { facingMode: { ideal: "environment" }, width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } },
  ]);
  let calls = 0;
  withDevices({ getUserMedia: () => (calls++, Promise.reject(refusal("NotAllowedError"))) });
  await assert.rejects(openCamera(new Video()), { code: "camera-denied" });
  assert.equal(calls, 1);
});

/** A camera as browsers list it. */
test("a camera that the system mutes is interrupted until it is unmuted, and plays on then", async () => {
  const stream = new Stream();
  withDevices({ getUserMedia: async () => stream, enumerateDevices: async () => [] });
  const video = new Video();
  const camera = await openCamera(video);
  const interrupted = told(camera, "interrupted");
  stream.track.mute(true);
  await interrupted;
  video.paused = true;
  page.show(true);
  await new Promise((resolve) => setTimeout(resolve, 5));
  assert.equal(camera.interrupted, true, "a call that goes on");
  const resumed = told(camera, "resumed");
  stream.track.mute(false);
  await resumed;
  assert.deepEqual([camera.interrupted, video.paused], [false, false]);
});

test("a video that was paused while the page was away plays on, also when the page comes out of the browser's cache", async () => {
  withDevices({ getUserMedia: async () => new Stream(), enumerateDevices: async () => [] });
  const video = new Video();
  await openCamera(video);
  const fromCache = () => self.dispatchEvent(Object.assign(new Event("pageshow"), { persisted: true }));
  for (const back of [() => page.show(true), fromCache]) {
    page.show(false);
    video.paused = true;
    page.visibilityState = "visible";
    back();
    await new Promise((resolve) => setTimeout(resolve, 5));
    assert.equal(video.paused, false);
  }
});

test("a camera that was taken away while the page was away is opened again when the page returns", async () => {
  const asked = [];
  const streams = [new Stream(), new Stream()];
  withDevices({
    getUserMedia: async ({ video }) => (asked.push(video.deviceId), streams[asked.length - 1]),
    enumerateDevices: async () => [],
  });
  const video = new Video();
  const camera = await openCamera(video);
  page.show(false);
  streams[0].track.end();
  assert.deepEqual([camera.interrupted, camera.error, asked.length], [true, null, 1]);
  const resumed = told(camera, "resumed");
  page.show(true);
  await resumed;
  assert.equal(video.srcObject, streams[1]);
  assert.deepEqual(asked[1], { exact: "back" });
});

test("a camera that cannot be opened again when the page returns is lost", async () => {
  const stream = new Stream();
  let calls = 0;
  withDevices({
    getUserMedia: async () => {
      if (calls++ > 0) throw refusal("NotFoundError");
      return stream;
    },
    enumerateDevices: async () => [],
  });
  const camera = await openCamera(new Video());
  page.show(false);
  stream.track.end();
  const lost = told(camera, "lost");
  page.show(true);
  await lost;
  assert.equal(camera.error.code, "camera-lost");
});

test("a track that ends is reported as a lost camera, and a camera that ends while it starts rejects", async () => {
  const stream = new Stream();
  withDevices({ getUserMedia: async () => stream, enumerateDevices: async () => [] });
  const camera = await openCamera(new Video());
  const lost = told(camera, "lost");
  stream.track.end();
  await lost;
  assert.equal(camera.error.code, "camera-lost");

  const short = new Stream();
  withDevices({ getUserMedia: async () => short, enumerateDevices: async () => [] });
  const video = new Video();
  video.play = async () => void short.track.end();
  await assert.rejects(openCamera(video), { code: "camera-lost" });
});

test("intrinsics are estimated from the size, follow a turned phone, and a calibration holds both ways round", async () => {
  withDevices({ getUserMedia: async () => new Stream(), enumerateDevices: async () => [] });
  const camera = await openCamera(new Video());
  const { fx, cx, cy, source } = camera.intrinsics(1280, 720);
  assert.deepEqual([fx, cx, cy, source], [0.79 * 1280, 640, 360, "estimated"]);
  camera.calibrate(1280, 720, 1100);
  const turned = camera.intrinsics(720, 1280);
  assert.deepEqual([turned.fx, turned.cx, turned.cy, turned.source], [1100, 360, 640, "calibrated"]);
  assert.equal(camera.intrinsics(640, 480).source, "estimated", "another size is another camera");
  camera.calibrate(1280, 720, null);
  assert.equal(camera.intrinsics(1280, 720).source, "estimated");
});

test("a calibration is kept with its deviation, and a less sure one does not take its place", async () => {
  const stored = new Map();
  const localStorage = {
    getItem: (key) => stored.get(key) ?? null,
    setItem: (key, value) => stored.set(key, value),
    removeItem: (key) => stored.delete(key),
  };
  globalThis.self.localStorage = localStorage;
  withDevices({ getUserMedia: async () => new Stream("Phone's back", "other"), enumerateDevices: async () => [] });
  const camera = await openCamera(new Video());
  const kept = (width, height) => {
    const { fx, spread, source } = camera.intrinsics(width, height);
    return [fx, spread, source];
  };
  assert.equal(camera.calibrate(1280, 720, 1000, 12), true);
  assert.deepEqual(kept(720, 1280), [1000, 12, "calibrated"]);
  assert.equal(camera.calibrate(1280, 720, 1100, 14), false, "1.3 % are more than 1.2 %");
  assert.deepEqual(kept(1280, 720), [1000, 12, "calibrated"]);
  assert.equal(camera.calibrate(1280, 720, 1020, 6), true);
  assert.deepEqual(kept(1280, 720), [1020, 6, "calibrated"]);
  assert.deepEqual([...stored.values()], ["1020 6"]);
  assert.equal(camera.calibrate(1280, 720, 990), true, "what somebody says without a deviation holds");
  assert.deepEqual([kept(1280, 720), [...stored.values()]], [[990, undefined, "calibrated"], ["990"]]);
  camera.calibrate(1280, 720, null);
  assert.deepEqual([kept(1280, 720)[2], stored.size], ["estimated", 0]);
  // As an earlier version of this package left it, and as nobody did.
  const [key] = ["deepsft/focal/Phone's back|environment|640|480"];
  stored.set(key, "505.5");
  assert.deepEqual(kept(640, 480), [505.5, undefined, "calibrated"]);
  stored.set(key.replace("640|480", "320|240"), "nonsense");
  assert.equal(kept(320, 240)[2], "estimated");
});

test("the cameras of the paper are those of the command line program", async () => {
  const source = await readFile(new URL("../../../crates/deepsft-geometry/src/camera/pinhole.rs", import.meta.url), "utf8");
  const theirs = [...source.matchAll(/"([a-z0-9-]+)" => \(\((\d+), (\d+)\), \[([^\]]+)\]\)/g)].map(([, name, width, height, intrinsics]) => {
    const [fx, fy, cx, cy] = intrinsics.split(", ").map(Number);
    return [name, { width: Number(width), height: Number(height), fx, fy, cx, cy }];
  });
  assert.equal(theirs.length, 3);
  assert.deepEqual(PAPER_CAMERAS, Object.fromEntries(theirs));
});
