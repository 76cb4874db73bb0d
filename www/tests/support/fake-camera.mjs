// Stand-ins for cameras, a video element and the page, fresh for each test of the file that imports them.

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
