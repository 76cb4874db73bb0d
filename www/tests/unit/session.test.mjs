// The session in JavaScript, against a tracker whose answers the test gives.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { setTimeout as wait } from "node:timers/promises";

import { CameraStream } from "deepsft";
import { DeepSftError } from "../../src/error.js";
import { Session } from "../../src/tracking/session.js";

/** All bitmaps that are open. */
const open = new Set();
globalThis.ImageData ??= class {};
globalThis.ImageBitmap ??= class {
  width = 480;
  height = 270;
  constructor() {
    open.add(this);
  }
  close() {
    open.delete(this);
  }
};
/** What the next copies come to, in turn: an error, or else a bitmap. */
let refusals = [];
globalThis.createImageBitmap ??= async () => {
  const refusal = refusals.shift();
  if (refusal) throw refusal;
  return new ImageBitmap();
};

const NEXT = { focal: 380, intervalMs: 0, question: null };
const SURFACE = { vertices: new Float32Array(9), confidence: new Float32Array(3), deviations: new Float32Array() };
const targetOf = (id, name = `target ${id}`) => ({ id, name, mesh: { faces: Uint32Array.of(0, 1, 2), textureCoordinates: new Float32Array(6) } });
const POSTER = targetOf(1, "poster");

/** A video whose frames the test shows. */
class FakeVideo extends EventTarget {
  readyState = 4;
  HAVE_CURRENT_DATA = 2;
  #shown = () => undefined;
  requestVideoFrameCallback(callback) {
    this.#shown = callback;
  }
  show(presentationTime) {
    this.#shown(0, { presentationTime });
  }
  getClientRects = () => [{}];
}

/** A worker that says of each frame what `answers` tells; `told` lists what it was told. */
class FakeWorker {
  hasEnded = false;
  told = [];
  answers = (request) => ({ found: request.number > 0 });
  #tracked = new Map();
  #frames = 0;
  call(method, request) {
    return this[method](request);
  }
  startTracker({ targets }) {
    for (const { id } of targets) this.#tracked.set(id, true);
    this.told.push(["start", ...this.#tracked.keys()]);
    return Promise.resolve();
  }
  async trackTarget({ id }) {
    this.#tracked.set(id, true);
    this.told.push(["track", id]);
  }
  async untrackTarget({ id }) {
    this.#tracked.delete(id);
    this.told.push(["untrack", id]);
  }
  async follow(request) {
    request.frame?.close?.();
    const { found = false, focal = null, next = NEXT, afresh = false } = this.answers({ ...request, number: ++this.#frames });
    const one = { found, held: false, surface: found ? SURFACE : null, correlation: found ? 0.9 : 0, iterations: 1 };
    const targets = [...this.#tracked.keys()].map((id) => ({ id, ...one }));
    return { targets, afresh, focal, next, times: { warpMs: 0, trackMs: 0 }, readMs: 0 };
  }
  async answer() {
    return { effects: [], next: null, answerMs: 0 };
  }
  terminate() {
    this.hasEnded = true;
  }
}

let worker;
let sessions;
beforeEach(() => {
  refusals = [];
  sessions = [];
  worker = new FakeWorker();
});
afterEach(() => {
  for (const session of sessions) session.close();
});

function follow(source, options = {}) {
  const session = new Session(source, {
    targets: [POSTER],
    startTracker: () => worker,
    module: null,
    smooth: null,
    sourceOf: ({ id }) => ({ id, source: null }),
    find: async ({ frame }) => (frame.close(), { answers: [], estimate: null }),
    ...options,
  });
  sessions.push(session);
  return session;
}

/** Frames of one's own. */
async function* frames(times, onTaken = () => undefined) {
  for (const timeMs of times) {
    yield { frame: {}, timeMs };
    onTaken(timeMs);
  }
}

const listen = (session, ...names) => {
  const events = [];
  for (const name of names) session.addEventListener(name, (event) => events.push([name, event.detail]));
  return events;
};

test("each frame of one's own is given, in order; it closes when the next one is asked for, unless it is kept", async () => {
  const [taken, given] = [[], []];
  let kept;
  const session = follow(frames([10, 20, 30], (timeMs) => taken.push(timeMs)));
  for await (const tracked of session) {
    given.push([tracked.number, tracked.timeMs, tracked.of(POSTER).found, tracked.frame !== null]);
    if (tracked.number === 2) (kept = tracked).keep();
  }
  assert.deepEqual(given, [1, 2, 3].map((number) => [number, 10 * number, true, true]));
  assert.deepEqual([taken, session.closed], [[10, 20, 30], true]);
  assert.deepEqual([...open], [kept.frame], "nothing else is open");
  kept.close();
});

test("found and lost are told exactly where `found` changes, also where all begins afresh", async () => {
  // Seen twice, then the phone is turned.
  worker.answers = ({ number }) => ({ found: number !== 3, afresh: number === 3 });
  const session = follow(frames([1, 2, 3, 4, 5]));
  const events = listen(session, "found", "lost");
  let before = false;
  for await (const tracked of session) {
    const { found } = tracked.of(POSTER);
    const told = events.splice(0).map(([name, { target, frame }]) => [name, target, frame]);
    assert.deepEqual(told, found === before ? [] : [[found ? "found" : "lost", POSTER, tracked]]);
    before = found;
  }
});

test("targets come and go while it runs, and frames are given with none", async () => {
  const session = follow(frames([1, 2, 3, 4, 5, 6]), { targets: [] });
  const [a, b] = [targetOf(7), targetOf(8)];
  const seen = [];
  for await (const { number, targets } of session) {
    seen.push(targets.map(({ target }) => target.id));
    if (number === 2) for (const target of [a, b, a]) session.addTarget(target);
    if (number === 4) session.removeTarget(a);
    if (number === 5) session.removeTarget(b);
    await wait(1);
  }
  assert.deepEqual(seen, [[], [], [7, 8], [7, 8], [8], []]);
  assert.deepEqual(worker.told, [["start"], ["track", 7], ["track", 8], ["untrack", 7], ["untrack", 8]]);
  assert.throws(() => session.addTarget(a), { code: "closed" });
});

test("leaving the loop, closing and a signal end it, and nothing stays open", async () => {
  const forever = () => {
    let time = 0;
    return { [Symbol.asyncIterator]: () => ({ next: async () => ({ value: { frame: {}, timeMs: ++time } }) }) };
  };
  const left = follow(forever());
  const ended = listen(left, "ended");
  for await (const { number } of left) if (number === 2) break;
  assert.deepEqual([left.closed, ended, worker.hasEnded], [true, [["ended", { error: null }]], true]);

  worker = new FakeWorker();
  const closed = follow(forever());
  for await (const { number } of closed) if (number === 2) closed.close();

  worker = new FakeWorker();
  const leaving = new AbortController();
  const aborted = follow(forever(), { signal: leaving.signal });
  const reasons = listen(aborted, "ended");
  await assert.rejects(async () => {
    for await (const { number } of aborted) if (number === 2) leaving.abort(new Error("unmounted"));
  }, /unmounted/);
  assert.match(reasons[0][1].error.message, /unmounted/);
  // Waiting for a frame that never comes.
  worker = new FakeWorker();
  const waiting = follow({ [Symbol.asyncIterator]: () => ({ next: () => new Promise(() => undefined) }) });
  setTimeout(() => waiting.close(), 5);
  for await (const _ of waiting) assert.fail();
  // The next frame is under way already when the loop is left.
  worker = new FakeWorker();
  const video = new FakeVideo();
  const next = { ...NEXT, question: { ids: [POSTER.id], onlyConfirms: false } };
  worker.answers = ({ number }) => (number === 1 && video.show(20), { next });
  const iterator = follow(video)[Symbol.asyncIterator]();
  const first = iterator.next();
  video.show(10);
  assert.equal((await first).value.number, 1);
  assert.equal(open.size, 3, "two frames, and one for the finders");
  await iterator.return();
  await wait(5);
  assert.equal(open.size, 0);
});

test("a frame that cannot be copied is left out, its question is asked with the next, and only DeepSftErrors get out", async () => {
  const asked = [];
  const find = async ({ ids, frame }) => (frame.close(), asked.push(ids), { answers: [], estimate: null });
  // The frame itself is there, its copy for the finders is not: as where memory is short.
  refusals = [null, new DOMException("no memory", "InvalidStateError")];
  const numbers = [];
  for await (const { number, timeMs } of follow(frames([1, 2, 3]), { find })) numbers.push([number, timeMs]);
  assert.deepEqual([numbers, asked], [[[1, 2], [2, 3]], [[1]]]);
  assert.equal(open.size, 0);

  worker = new FakeWorker();
  const broken = (async function* () {
    yield { frame: {}, timeMs: 1 };
    throw new TypeError("the decoder is broken");
  })();
  await assert.rejects(async () => {
    for await (const _ of follow(broken));
  }, ({ name, code, cause }) => name === "DeepSftError" && code === "image-unreadable" && cause instanceof TypeError);
  worker = new FakeWorker();
  await assert.rejects(async () => {
    for await (const _ of follow(frames([Number.NaN])));
  }, { code: "image-unreadable" });
  worker = new FakeWorker();
  await assert.rejects(async () => {
    for await (const _ of follow(frames([1]), { find: () => Promise.reject(new DeepSftError("gpu-lost", "")) })) await wait(1);
  }, { code: "gpu-lost" });
});

test("a source that gives nothing is told as stalled once, with its reason, and again after it has gone on", async (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  let now = 0;
  t.mock.method(performance, "now", () => now);
  globalThis.requestAnimationFrame = () => undefined;
  t.after(() => delete globalThis.requestAnimationFrame);
  const video = Object.assign(new FakeVideo(), { paused: true });
  const session = follow(video);
  const events = listen(session, "stalled");
  const pass = (ms) => {
    for (; ms > 0; ms -= 1000) {
      now += 1000;
      t.mock.timers.tick(1000);
    }
  };
  pass(2000);
  assert.deepEqual(events, []);
  pass(8000);
  assert.deepEqual(events, [["stalled", { reason: "paused" }]]);
  video.show(now);
  video.paused = false;
  video.getClientRects = () => [];
  t.mock.timers.tick(1000);
  pass(4000);
  assert.deepEqual(events.slice(1), [["stalled", { reason: "hidden" }]]);
});

test("where the browser does not tell of frames though the video plays, it is looked for them", async (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  let now = 0;
  t.mock.method(performance, "now", () => now);
  let refresh = () => undefined;
  globalThis.requestAnimationFrame = (callback) => (refresh = callback);
  t.after(() => delete globalThis.requestAnimationFrame);
  const video = Object.assign(new FakeVideo(), { currentTime: 0 });
  const iterator = follow(video)[Symbol.asyncIterator]();
  const first = iterator.next();
  now = 2000;
  t.mock.timers.tick(1000);
  video.currentTime = 0.04;
  refresh(2040);
  const { value } = await first;
  assert.equal(value.timeMs, 2040);
});

/** A camera as `openCamera` gives it. */
function fakeCamera(video) {
  const track = Object.assign(new EventTarget(), { label: "Camera", getSettings: () => ({}), stop: () => undefined });
  return new CameraStream(video, { getVideoTracks: () => [track], getTracks: () => [track] });
}

test("a camera calibrates itself; its interruptions are told, and its loss ends the session", async (t) => {
  globalThis.self = new EventTarget();
  t.after(() => delete globalThis.self);
  const video = new FakeVideo();
  const camera = fakeCamera(video);
  const deviations = [];
  worker.answers = ({ focalDeviation }) => (deviations.push(focalDeviation), { focal: { ratio: 1.1, deviation: 0.01 } });
  const session = follow(camera);
  const events = listen(session, "focal", "interrupted");
  const iterator = session[Symbol.asyncIterator]();
  const next = async (at) => (video.show(at), (await iterator.next()).value);
  assert.equal((await next(10)).camera.source, "estimated");
  const { camera: known } = await next(20);
  const focal = 1.1 * 0.79 * 480;
  assert.deepEqual([known.source, known.fx.toFixed(6), deviations[0]], ["calibrated", focal.toFixed(6), Infinity]);
  assert.equal(events[0][1].focal, focal);
  camera.dispatchEvent(new Event("interrupted"));
  assert.equal(events.at(-1)[0], "interrupted");
  camera.error = new DeepSftError("camera-lost", "");
  const rest = iterator.next();
  camera.close();
  await assert.rejects(rest, { code: "camera-lost" });

  worker = new FakeWorker();
  worker.answers = ({ focalDeviation }) => (deviations.push(focalDeviation), {});
  const other = fakeCamera(video);
  other.interrupted = true;
  const uncalibrated = follow(other, { calibrate: false });
  const early = listen(uncalibrated, "interrupted");
  video.show(30);
  await uncalibrated[Symbol.asyncIterator]().next();
  assert.equal(deviations.at(-1), 0);
  assert.equal(early.length, 1, "what was so before is told when it begins");
  other.close();
  assert.equal(uncalibrated.closed, true, "whoever stops the camera ends what follows it");
});

test("the last frame of a clip is given, though one that came too soon after it waits", async () => {
  const video = new FakeVideo();
  worker.answers = () => ({ next: { ...NEXT, intervalMs: 60_000 } });
  const given = [];
  const session = follow(video);
  const running = (async () => {
    for await (const { number } of session) given.push(number);
  })();
  video.show(10);
  await wait(1);
  video.show(20);
  await wait(5);
  assert.deepEqual(given, [1]);
  session.close();
  await running;
});
