import assert from "node:assert/strict";
import { test } from "node:test";

import { nameOf } from "../../demo/live/camera-switch.js";

const named = (...cameras) => {
  const all = cameras.map(([label, facing]) => ({ deviceId: label, label, facing }));
  return all.map((camera) => nameOf(camera, all));
};

test("a camera is called by the way it looks where no other looks that way, else by its own name", () => {
  assert.deepEqual(named(["Rückkamera", "environment"], ["Frontkamera", "user"]), ["Back camera", "Front camera"]);
  assert.deepEqual(
    named(["camera2 1, facing front", "user"], ["camera2 2, facing back", "environment"], ["camera2 0, facing back", "environment"]),
    ["Front camera", "Back camera 1", "Back camera 2"],
  );
  assert.deepEqual(named(["Back Camera", "environment"], ["Back Ultra Wide Camera", "environment"]), ["Back Camera", "Back Ultra Wide Camera"]);
  assert.deepEqual(named(["HD Webcam (04f2:b6cb)", ""], ["Virtual (beta) Camera", ""]), ["HD Webcam", "Virtual (beta) Camera"]);
});
