// openCamera against getUserMedia stand-ins that refuse as browsers do; the real thing is in tests/browser.

import assert from "node:assert/strict";
import { afterEach, test } from "node:test";

import { openCamera } from "deepsft";

class Track extends EventTarget {
  label = "Front Camera";
  stopped = false;
  getSettings = () => ({ facingMode: "environment", deviceId: this.deviceId });
  stop() {
    this.stopped = true;
  }
}

class Stream {
  constructor(label = "Back Camera") {
    this.track = new Track();
    this.track.label = label;
  }
  getTracks = () => [this.track];
  getVideoTracks = () => [this.track];
}

class Video extends EventTarget {
  srcObject = null;
  async play() {
    queueMicrotask(() => this.dispatchEvent(new Event("loadeddata")));
  }
}

const realNavigator = Object.getOwnPropertyDescriptor(globalThis, "navigator");
afterEach(() =>
  realNavigator ? Object.defineProperty(globalThis, "navigator", realNavigator) : delete globalThis.navigator,
);

function withDevices(mediaDevices) {
  Object.defineProperty(globalThis, "navigator", { value: { mediaDevices }, configurable: true });
}

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
    withDevices({ getUserMedia: () => Promise.reject(refusal(name)) });
    await assert.rejects(openCamera(new Video()), { name: "DeepSftError", code });
  });
}

test("a page without mediaDevices is told that its address is not secure", async () => {
  withDevices(undefined);
  await assert.rejects(openCamera(new Video()), { code: "insecure-context" });
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
    {},
  ]);
  let calls = 0;
  withDevices({ getUserMedia: () => (calls++, Promise.reject(refusal("NotAllowedError"))) });
  await assert.rejects(openCamera(new Video()), { code: "camera-denied" });
  assert.equal(calls, 1);
});

test("of several back cameras the main one is taken, and the other one is let go first", async () => {
  const wide = new Stream("Back Ultra Wide Camera");
  const main = new Stream("Back Camera");
  withDevices({
    getUserMedia: async ({ video }) => {
      if (!video.deviceId) return wide;
      assert.equal(wide.track.stopped, true);
      assert.deepEqual(video.deviceId, { exact: "main" });
      return main;
    },
    enumerateDevices: async () => [
      { kind: "audioinput", label: "Back Camera", deviceId: "microphone" },
      { kind: "videoinput", label: "Back Ultra Wide Camera", deviceId: "wide" },
      { kind: "videoinput", label: "Back Camera", deviceId: "main" },
    ],
  });
  assert.equal((await openCamera(new Video())).label, "Back Camera");
});

test("a track that ends is reported as a lost camera, and a camera that ends while it starts rejects", async () => {
  const stream = new Stream();
  withDevices({ getUserMedia: async () => stream, enumerateDevices: async () => [] });
  const camera = await openCamera(new Video());
  const lost = new Promise((resolve) => camera.addEventListener("lost", resolve, { once: true }));
  stream.track.dispatchEvent(new Event("ended"));
  await lost;
  assert.equal(camera.error.code, "camera-lost");
  assert.equal(stream.track.stopped, true);

  const short = new Stream();
  withDevices({ getUserMedia: async () => short, enumerateDevices: async () => [] });
  const video = new Video();
  video.play = async () => void short.track.dispatchEvent(new Event("ended"));
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
