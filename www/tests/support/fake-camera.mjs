// Stand-ins for cameras, a video element and the page, fresh for each test of the file that imports them.

import assert from "node:assert/strict";
import { afterEach, beforeEach } from "node:test";

export class Track extends EventTarget {
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

export class Stream {
  constructor(label = "Back Camera", deviceId = "back") {
    this.track = new Track(deviceId);
    this.track.label = label;
  }
  getTracks = () => [this.track];
  getVideoTracks = () => [this.track];
}

export class Video extends EventTarget {
  srcObject = null;
  paused = true;
  async play() {
    this.paused = false;
    queueMicrotask(() => this.dispatchEvent(new Event("loadeddata")));
  }
}

/** The page: shown, or away. */
export class Page extends EventTarget {
  visibilityState = "visible";
  show(visible) {
    this.visibilityState = visible ? "visible" : "hidden";
    this.dispatchEvent(new Event("visibilitychange"));
  }
}

/** The page of the test that runs. */
export let page;
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

export function withDevices(mediaDevices) {
  Object.defineProperty(globalThis, "navigator", { value: { mediaDevices }, configurable: true });
}

export const told = (camera, event) => new Promise((resolve) => camera.addEventListener(event, resolve, { once: true }));

export const refusal = (name) => Object.assign(new Error(name), { name });

export const listed = (deviceId, facing, width, height) => ({
  kind: "videoinput",
  // Labels are in the person's language.
  label: `Kamera ${deviceId}`,
  deviceId,
  getCapabilities: () => ({ facingMode: [facing], width: { min: 1, max: width }, height: { min: 1, max: height } }),
});

/** A phone with a front and a back camera that opens one at a time; `broken` do not open, `meanwhile` is called while one opens. */
export function phone({ broken = [], meanwhile = () => {}, refuse = () => false } = {}) {
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
