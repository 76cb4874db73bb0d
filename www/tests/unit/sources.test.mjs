// Where the demo page's pictures come from and what it looks for, when the person has gone on meanwhile.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { DeepSft } from "deepsft";

globalThis.location ??= new URL("http://host/");
const { clipSource } = await import("../../demo/sources.js");
const { Subjects } = await import("../../demo/subjects.js");

const { fetch } = globalThis;
const { load } = DeepSft;
beforeEach(() => Object.assign(globalThis, { document: new EventTarget(), addEventListener: () => undefined }));
afterEach(() => {
  Object.assign(globalThis, { fetch });
  DeepSft.load = load;
  for (const name of ["document", "addEventListener"]) delete globalThis[name];
});
const settle = () => new Promise(setImmediate);

/** The page's video, which all its pictures share; it plays what `codings` name. */
class Video {
  done = [];
  constructor(...codings) {
    this.codings = codings;
  }
  canPlayType(type) {
    return this.codings.some((coding) => type.includes(coding)) ? "probably" : "";
  }
  set src(address) {
    this.done.push(address.replace(/:.*/, ""));
  }
  async play() {
    this.done.push("play");
  }
  pause() {
    this.done.push("pause");
  }
  removeAttribute() {}
  load() {}
}

test("a clip that comes when it is wanted no more leaves the video to what plays there by then", async () => {
  const served = [];
  globalThis.fetch = (url, { signal }) =>
    new Promise((resolve, reject) => {
      served.push(() => resolve(new Response(url.endsWith("json") ? '{"camera":{}}' : "film")));
      signal.addEventListener("abort", () => reject(signal.reason));
    });
  const leaving = new AbortController();
  const video = new Video("vp8");
  const opening = clipSource(video, leaving.signal);
  opening.catch(() => undefined);
  leaving.abort();
  for (const serve of served) serve();
  await assert.rejects(opening, { name: "AbortError" });
  assert.deepEqual(video.done, []);

  const later = new AbortController();
  const watching = clipSource(video, later.signal);
  await settle();
  for (const serve of served.splice(0)) serve();
  await watching;
  assert.deepEqual(video.done, ["blob", "play"]);
  later.abort();
  assert.deepEqual(video.done, ["blob", "play", "pause"], "it is free at once");
});

test("the small coding of the clip comes first, where the browser has it", async () => {
  const asked = [];
  globalThis.fetch = async (url) => (asked.push(url), new Response(url.endsWith("json") ? '{"camera":{}}' : "film"));
  for (const codings of [["avc1", "vp8"], ["vp8"]]) await clipSource(new Video(...codings), new AbortController().signal);
  assert.deepEqual(asked.filter((url) => !url.endsWith("json")), ["demo/clip.mp4", "demo/clip.webm"]);
});

test("a person's own picture waits for no model, and does not fail with it", async () => {
  const loads = [];
  DeepSft.load = (model) => {
    const sft = { model, targets: ["poster"], removeTarget: () => undefined, addPicture: async () => `target of ${model ?? "no model"}` };
    return new Promise((resolve, reject) => loads.push({ model, succeed: () => resolve(sft), fail: () => reject(new Error("no network")) }));
  };
  const learned = [];
  const subjects = new Subjects(() => undefined, () => learned.push("learning"));
  const poster = subjects.ready();
  poster.catch(() => undefined);
  subjects.chosen = { canvas: {}, name: "mine", widthMm: 100 };
  const own = subjects.ready();
  await settle();
  assert.deepEqual(loads.map(({ model }) => model), ["models/poster-a4/", undefined]);
  loads[1].succeed();
  assert.equal((await own).target, "target of no model");
  loads[0].fail();
  await assert.rejects(poster, /no network/);
  // Chosen, and left for the poster before it is learned.
  const other = { canvas: {}, name: "other", widthMm: 100 };
  subjects.chosen = other;
  const late = subjects.ready();
  subjects.chosen = "poster";
  await late;
  assert.deepEqual(learned, ["learning"], "who looks at the poster is not told of it");
});
