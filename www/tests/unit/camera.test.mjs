// openCamera against getUserMedia stand-ins that refuse as browsers do; the real thing is in tests/browser.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { afterEach, beforeEach, test } from "node:test";

import { PAPER_CAMERAS, listCameras, openCamera } from "deepsft";

class Track extends EventTarget {
  label = "Front Camera";
  readyState = "live";
  muted = false;
  constructor(deviceId) {
    super();
    this.deviceId = deviceId;
  }
  getSettings = () => ({ facingMode: "environment", deviceId: this.deviceId });
  stop() {
    this.readyState = "ended";
  }
  /** The browser takes the camera away. */
  end() {
    this.readyState = "ended";
    this.dispatchEvent(new Event("ended"));
  }
  mute(muted) {
    this.muted = muted;
    this.dispatchEvent(new Event(muted ? "mute" : "unmute"));
  }
}

class Stream {
  constructor(label = "Back Camera", deviceId = "back") {
    this.track = new Track(deviceId);
    this.track.label = label;
  }
  getTracks = () => [this.track];
  getVideoTracks = () => [this.track];
}

class Video extends EventTarget {
  srcObject = null;
  paused = true;
  async play() {
    this.paused = false;
    queueMicrotask(() => this.dispatchEvent(new Event("loadeddata")));
  }
}

/** The page: shown, or away. */
class Page extends EventTarget {
  visibilityState = "visible";
  show(visible) {
    this.visibilityState = visible ? "visible" : "hidden";
    this.dispatchEvent(new Event("visibilitychange"));
  }
}

let page;
const realNavigator = Object.getOwnPropertyDescriptor(globalThis, "navigator");
beforeEach(() => {
  page = new Page();
  Object.assign(globalThis, { document: page, self: new EventTarget() });
});
afterEach(() => {
  delete globalThis.document;
  delete globalThis.self;
  if (realNavigator) Object.defineProperty(globalThis, "navigator", realNavigator);
  else delete globalThis.navigator;
});

function withDevices(mediaDevices) {
  Object.defineProperty(globalThis, "navigator", { value: { mediaDevices }, configurable: true });
}

const told = (camera, event) => new Promise((resolve) => camera.addEventListener(event, resolve, { once: true }));

const refusal = (name) => Object.assign(new Error(name), { name });

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
const listed = (deviceId, facing, width, height) => ({
  kind: "videoinput",
  // Labels are in the person's language.
  label: `Kamera ${deviceId}`,
  deviceId,
  getCapabilities: () => ({ facingMode: [facing], width: { min: 1, max: width }, height: { min: 1, max: height } }),
});
const PHONE_CAMERAS = [
  { kind: "audioinput", label: "Back Camera", deviceId: "microphone" },
  listed("front", "user", 6000, 4000),
  listed("wide", "environment", 3264, 2448),
  listed("main", "environment", 4080, 3060),
];

test("of several back cameras the one with the most pixels is taken, and the other one is let go first", async () => {
  const [wide, main] = [new Stream("Kamera wide", "wide"), new Stream("Kamera main", "main")];
  withDevices({
    getUserMedia: async ({ video }) => {
      if (!video.deviceId) return wide;
      assert.equal(wide.track.readyState, "ended");
      assert.deepEqual(video.deviceId, { exact: "main" });
      return main;
    },
    enumerateDevices: async () => PHONE_CAMERAS,
  });
  assert.equal((await openCamera(new Video())).deviceId, "main");
});

test("a main camera that does not open gives the first one back", async () => {
  const opened = [];
  withDevices({
    getUserMedia: async ({ video }) => {
      const id = video.deviceId?.exact ?? "wide";
      opened.push(id);
      if (id === "main") throw refusal("NotReadableError");
      return new Stream(`Kamera ${id}`, id);
    },
    enumerateDevices: async () => PHONE_CAMERAS,
  });
  const camera = await openCamera(new Video());
  assert.deepEqual(opened, ["wide", "main", "wide"]);
  assert.equal(camera.deviceId, "wide");
});

test("a camera that is the main one, or whose browser does not tell, stays", async () => {
  for (const cameras of [PHONE_CAMERAS.slice(0, 3), PHONE_CAMERAS.map((one) => ({ ...one, getCapabilities: undefined }))]) {
    let calls = 0;
    withDevices({
      getUserMedia: async () => (calls++, new Stream("Kamera wide", "wide")),
      enumerateDevices: async () => cameras,
    });
    await openCamera(new Video());
    assert.equal(calls, 1);
  }
});

test("names tell the main back camera, whatever the pixels of the others", async () => {
  const named = (label, width, height) => ({ ...listed(label, "environment", width, height), label });
  const android = [named("camera2 2, facing back", 9248, 6936), named("camera2 0, facing back", 4000, 3000), named("camera2 3, facing back", 3264, 2448)];
  const firefox = ["Facing back:2", "Facing back:0"].map((label) => ({ kind: "videoinput", label, deviceId: label }));
  // The virtual one changes between lenses without a word.
  const iphone = ["Back Triple Camera", "Back Dual Wide Camera", "Back Ultra Wide Camera", "Back Camera", "Back Telephoto Camera"];
  for (const [cameras, open, main] of [
    [android, "camera2 2, facing back", "camera2 0, facing back"],
    [android, "camera2 3, facing back", "camera2 0, facing back"],
    [android, "camera2 0, facing back", "camera2 0, facing back"],
    [firefox, "Facing back:2", "Facing back:0"],
    [iphone.map((label) => named(label, 4032, 3024)), "Back Triple Camera", "Back Camera"],
    [iphone.map((label) => named(label, 4032, 3024)), "Back Camera", "Back Camera"],
    // Without the main one in the list there is nothing to choose.
    [[named("Back Ultra Wide Camera", 4032, 3024)], "Back Ultra Wide Camera", "Back Ultra Wide Camera"],
  ]) {
    withDevices({
      getUserMedia: async ({ video }) => {
        const id = video.deviceId?.exact ?? open;
        return new Stream(id, id);
      },
      enumerateDevices: async () => cameras,
    });
    assert.equal((await openCamera(new Video())).deviceId, main, open);
  }
});

test("cameras say which way they look, by their capabilities or else their English names", async () => {
  const named = (label) => ({ kind: "videoinput", label, deviceId: label });
  const devices = [...PHONE_CAMERAS, ...["camera2 0, facing back", "camera2 1, facing front", "Frontier Cam"].map(named)];
  withDevices({ enumerateDevices: async () => devices });
  const cameras = await listCameras();
  assert.deepEqual(
    cameras.map(({ facing }) => facing),
    ["user", "environment", "environment", "environment", "user", ""],
  );
});

/** A phone with a front and a back camera that opens one at a time; `broken` do not open, `meanwhile` is called while one opens. */
function phone({ broken = [], meanwhile = () => {}, refuse = () => false } = {}) {
  const opened = [];
  const cameras = { back: "environment", front: "user" };
  withDevices({
    getUserMedia: async ({ video: { deviceId, facingMode } }) => {
      assert.ok(opened.every(({ track }) => track.readyState === "ended"), "one camera at a time");
      const facing = facingMode?.exact ?? facingMode?.ideal;
      const id = deviceId?.exact ?? Object.keys(cameras).find((camera) => cameras[camera] === facing);
      if (!cameras[id]) throw refusal("OverconstrainedError");
      if (broken.includes(id) || refuse()) throw refusal("NotReadableError");
      if (opened.length > 0) await meanwhile();
      const stream = new Stream(`Kamera ${id}`, id);
      stream.track.getSettings = () => ({ deviceId: id, facingMode: cameras[id] });
      opened.push(stream);
      return stream;
    },
    enumerateDevices: async () => [listed("back", "environment", 640, 480), listed("front", "user", 640, 480)],
  });
  return { opened, broken };
}

test("a camera is switched in the same video by which way it looks or by its identifier, and its interruptions are told then", async () => {
  const { opened } = phone();
  const video = new Video();
  const camera = await openCamera(video);
  const events = [];
  for (const name of ["switched", "interrupted", "resumed", "lost"]) camera.addEventListener(name, () => events.push(name));
  await camera.switchTo({ facing: "user" });
  assert.deepEqual([camera.deviceId, camera.facing, video.srcObject], ["front", "user", opened[1]]);
  opened[0].track.mute(true);
  opened[0].track.end();
  await camera.switchTo({ deviceId: "back" });
  assert.equal(camera.deviceId, "back");
  assert.deepEqual(events, ["switched", "switched"]);
  opened[2].track.mute(true);
  assert.deepEqual(events.slice(2), ["interrupted"]);
});

test("switches that are asked for at once happen in turn", async () => {
  phone();
  const camera = await openCamera(new Video());
  await Promise.all([camera.switchTo({ facing: "user" }), camera.switchTo({ deviceId: "back" }), camera.switchTo({ facing: "user" })]);
  assert.equal(camera.facing, "user");
});

test("a camera that does not open, or ends while it starts, leaves the former one playing", async () => {
  const { opened, broken } = phone({ broken: ["front"] });
  const video = new Video();
  const camera = await openCamera(video);
  let lost = false;
  camera.addEventListener("lost", () => (lost = true));
  await assert.rejects(camera.switchTo({ facing: "user" }), { name: "DeepSftError", code: "camera-busy" });
  await assert.rejects(camera.switchTo({ deviceId: "gone" }), { code: "camera-constraints" });
  broken.length = 0;
  const { play } = video;
  video.play = async () => {
    video.play = play;
    opened.at(-1).track.end();
  };
  await assert.rejects(camera.switchTo({ facing: "user" }), { code: "camera-busy" });
  assert.deepEqual([camera.deviceId, camera.error, lost, video.paused], ["back", null, false, false]);
  assert.equal(video.srcObject, opened.at(-1));
  // As at the end of the page's loading, which is no return to it.
  self.dispatchEvent(Object.assign(new Event("pageshow"), { persisted: false }));
  opened.at(-1).track.end();
  assert.equal(lost, true, "the former one is watched as before");
});

test("where the former camera does not open again either, the camera is lost; one that was stopped opens no other", async () => {
  const { broken } = phone();
  const camera = await openCamera(new Video());
  const lost = told(camera, "lost");
  broken.push("front", "back");
  await assert.rejects(camera.switchTo({ facing: "user" }), { code: "camera-lost" });
  await lost;
  await assert.rejects(camera.switchTo({ facing: "user" }), { code: "camera-lost" });

  const { opened } = phone();
  const stopped = await openCamera(new Video());
  const switching = stopped.switchTo({ facing: "user" });
  stopped.close();
  await assert.rejects(switching, { code: "closed" });
  assert.ok(opened.every(({ track }) => track.readyState === "ended"));
});

test("a page that went away while its camera was switched plays on when it returns", async () => {
  const { opened } = phone({
    async meanwhile() {
      await undefined;
      page.show(false);
      page.show(true);
      await new Promise((resolve) => setTimeout(resolve, 5));
    },
  });
  const video = new Video();
  const camera = await openCamera(video);
  await camera.switchTo({ facing: "user" });
  await new Promise((resolve) => setTimeout(resolve, 5));
  assert.deepEqual([camera.facing, opened.length, video.paused], ["user", 2, false]);
  opened[1].track.readyState = "ended";
  const resumed = told(camera, "resumed");
  page.show(true);
  await resumed;
  assert.deepEqual([camera.facing, opened.length], ["user", 3], "the camera that was switched to is opened again");
});

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
