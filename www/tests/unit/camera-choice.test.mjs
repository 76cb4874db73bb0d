// Which of several cameras is opened, and how one is switched for another, against stand-ins of getUserMedia.

import assert from "node:assert/strict";
import { test } from "node:test";

import { listCameras, openCamera } from "deepsft";
import { Stream, Video, listed, page, phone, refusal, told, withDevices } from "../support/fake-camera.mjs";

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
