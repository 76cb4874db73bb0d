// The page's side of browser.mjs.

import { fetchBundle } from "../src/engine/bundle.js";
import { compileEngine } from "../src/engine/engine-worker.js";
import { CANONICAL_HEIGHT, CANONICAL_WIDTH, DeepSft } from "../src/index.js";
import { intrinsicsOf } from "../src/camera/intrinsics.js";
import { WorkerCalls } from "../src/engine/worker-calls.js";

/** Turns before the measured ones. */
const WARM_UP = 3;

/** Frames of the clip that the mesh is followed through: as many as `deepsft-lab bench --export` writes. */
const CLIP_FRAMES = 24;

/** Rows of the network's input: the canonical image's, up to a multiple of 16. */
const INPUT_HEIGHT = 272;

const PIXELS = CANONICAL_WIDTH * CANONICAL_HEIGHT;

/** @param {number[]} times milliseconds */
function summary(times) {
  const sorted = [...times].sort((a, b) => a - b);
  const middle = (sorted[(sorted.length - 1) >> 1] + sorted[sorted.length >> 1]) / 2;
  return { median_ms: middle, min_ms: sorted[0], max_ms: sorted[sorted.length - 1] };
}

/** @param {string} url */
async function imageData(url) {
  const bitmap = await createImageBitmap(await (await fetch(url)).blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** The same work as the engine's "network" stage, by onnxruntime-web: pixels to tensor, network, tensor to maps. */
class OnnxRuntime {
  #ort;
  #session;
  #range;
  #input = new Float32Array(3 * INPUT_HEIGHT * CANONICAL_WIDTH);

  /**
   * @param {{ near_mm: number, far_mm: number }} range depths that the network can say
   * @param {"wasm" | "webgpu"} provider
   */
  static async load(range, provider) {
    const ort = await import(`/bench-onnxruntime/ort.${provider}.min.mjs`);
    ort.env.wasm.numThreads = 1;
    ort.env.wasm.wasmPaths = new URL("/bench-onnxruntime/", location.href).href;
    const session = await ort.InferenceSession.create("/bench-network.onnx", { executionProviders: [provider] });
    return new OnnxRuntime(ort, session, range);
  }

  constructor(ort, session, range) {
    this.#ort = ort;
    this.#session = session;
    this.#range = range;
  }

  get version() {
    return this.#ort.env.versions.web;
  }

  /** @param {ImageData} canonical */
  async estimate(canonical) {
    const began = performance.now();
    const plane = INPUT_HEIGHT * CANONICAL_WIDTH;
    for (let pixel = 0; pixel < PIXELS; pixel++) {
      for (let channel = 0; channel < 3; channel++) {
        this.#input[channel * plane + pixel] = canonical.data[4 * pixel + channel] / 255;
      }
    }
    const images = new this.#ort.Tensor("float32", this.#input, [1, 3, INPUT_HEIGHT, CANONICAL_WIDTH]);
    const running = performance.now();
    const { pixels, mask } = await this.#session.run({ images });
    const aloneMs = performance.now() - running;
    const depth = new Float32Array(PIXELS).fill(-1);
    const registration = new Float32Array(2 * PIXELS).fill(-1);
    const { near_mm: near, far_mm: far } = this.#range;
    for (let pixel = 0; pixel < PIXELS; pixel++) {
      if (mask.data[pixel] < 0) continue;
      depth[pixel] = near * (far / near) ** pixels.data[2 * plane + pixel];
      registration[2 * pixel] = pixels.data[pixel];
      registration[2 * pixel + 1] = pixels.data[plane + pixel];
    }
    return { depth, registration, aloneMs, networkMs: performance.now() - began };
  }
}

/**
 * How far two programs' maps are apart: share of the pixels on which their masks differ, and median differences where
 * both see the object.
 */
function difference(ours, theirs) {
  const [depth, registration] = [ours.depth.values(), ours.registration.values()];
  let outvoted = 0;
  const depths = [];
  const positions = [];
  for (let pixel = 0; pixel < PIXELS; pixel++) {
    if (depth[pixel] > 0 !== theirs.depth[pixel] > 0) outvoted++;
    else if (depth[pixel] > 0) {
      depths.push(Math.abs(depth[pixel] - theirs.depth[pixel]));
      const apart = [0, 1].map((k) => registration[2 * pixel + k] - theirs.registration[2 * pixel + k]);
      positions.push(Math.hypot(...apart));
    }
  }
  const median = (values) => (values.length > 0 ? summary(values).median_ms : null);
  return { mask_share: outvoted / PIXELS, depth_mm: median(depths), registration: median(positions) };
}

/**
 * What follows the network, on the same frames as `deepsft-lab bench` measures natively: the mesh fitted to one frame, the start
 * of a track, and a frame followed. The tracker has a worker and an instance of the engine of its own, as on a page.
 *
 * @param {DeepSft} sft
 * @param {{ width: number, height: number, fx: number, fy: number, cx: number, cy: number }} camera of the clip
 */
async function measureMesh(sft, camera) {
  const numbers = Array.from({ length: CLIP_FRAMES }, (_, k) => k);
  const clip = await Promise.all(numbers.map((k) => imageData(`/bench-export/clip-${String(k).padStart(2, "0")}.png`)));
  const copy = (frame) => new ImageData(new Uint8ClampedArray(frame.data), frame.width, frame.height);
  const [fit, completion, trackStart, track, answers] = [[], [], [], [], []];
  for (const frame of clip) {
    const fitted = await sft.estimate(copy(frame), { camera, fit: true });
    fit.push(fitted.times.fitMs);
    fitted.close();
    const plain = await sft.estimate(copy(frame), { camera });
    if (!plain.found) throw new Error("the network did not find the template in the clip");
    // The first mesh of the engine waits for the matrix to be analysed; the median does not see it.
    const began = performance.now();
    await plain.completeMesh({ method: "completion" });
    completion.push(performance.now() - began);
    answers.push((await plain.completeMesh()).vertices);
    plain.close();
  }
  const [module, files] = await Promise.all([
    compileEngine(new URL("/dist/deepsft_web_bg.wasm", location.href), {}),
    fetchBundle(new URL("/bench-model/", location.href), {}),
  ]);
  const tracker = new WorkerCalls();
  try {
    await tracker.call("startTracker", { module, targets: [{ id: 0, source: { kind: "model", files } }], smooth: null });
    const intrinsics = intrinsicsOf({ ...camera, distortion: [0, 0, 0, 0, 0] });
    const question = { ids: [0], onlyConfirms: false };
    const follow = (timeS, k, asked) =>
      tracker.call("follow", { timeS, afresh: timeS === 0, frame: copy(clip[k]), intrinsics, question: asked ? question : null });
    const answer = (vertices) =>
      tracker.call("answer", { answers: [{ id: 0, sightings: [vertices.slice()] }], tookMs: 0, sinceMissedMs: Infinity });
    for (const k of numbers) {
      await follow(0, k, true);
      const { effects: [{ effect }], answerMs } = await answer(answers[k]);
      if (effect !== "started") throw new Error(`the tracker did not start on frame ${k} of the clip`);
      trackStart.push(answerMs);
    }
    for (const k of numbers) {
      const tracked = await follow(k / 30, k, k === 0);
      if (k === 0) {
        await answer(answers[0]);
      } else {
        if (!tracked.targets[0].found) throw new Error(`the tracker lost frame ${k} of the clip`);
        track.push(tracked.times.trackMs);
      }
    }
  } finally {
    tracker.terminate(new Error("measured"));
  }
  return {
    frames: CLIP_FRAMES,
    fit: summary(fit),
    completion: summary(completion),
    track_start: summary(trackStart),
    track: summary(track),
  };
}

/** The frame, its camera, and what the model says of itself. */
async function material() {
  const frame = await imageData("/bench-export/frame.png");
  const description = await (await fetch("/bench-model/model.json")).json();
  const trained = description.training_camera;
  const scale = frame.width / trained.width;
  const [fx, fy, cx, cy] = [trained.fx, trained.fy, trained.cx, trained.cy].map((value) => value * scale);
  const camera = { width: frame.width, height: frame.height, fx, fy, cx, cy };
  return { frame, camera, trained, range: description.network.depth_range };
}

/**
 * This package and onnxruntime-web on the same frame, in turns.
 *
 * @param {{ device: "cpu" | "webgpu", warmUp: number, runs: number, withOnnxRuntime: boolean }} options
 */
async function takeTurns({ device, warmUp, runs, withOnnxRuntime }) {
  const { frame, camera, trained, range } = await material();
  let began = performance.now();
  const sft = await DeepSft.load("/bench-model/", { device });
  const loadMs = performance.now() - began;
  began = performance.now();
  const rival = withOnnxRuntime ? await OnnxRuntime.load(range, device === "cpu" ? "wasm" : "webgpu") : null;
  const rivalLoadMs = performance.now() - began;

  const ours = { warp: [], network: [], judge: [], frame: [] };
  const theirs = { network: [], alone: [] };
  let apart = null;
  for (let turn = 0; turn < warmUp + runs; turn++) {
    // The frame's pixels move to the worker: it gets a copy each time.
    const copy = new ImageData(new Uint8ClampedArray(frame.data), frame.width, frame.height);
    const estimate = await sft.estimate(copy, { camera });
    const answer = await rival?.estimate(estimate.canonical);
    if (turn >= warmUp) {
      const { warpMs, networkMs, judgeMs } = estimate.times;
      ours.warp.push(warpMs);
      ours.network.push(networkMs);
      ours.judge.push(judgeMs);
      ours.frame.push(warpMs + networkMs + judgeMs);
      if (answer) {
        theirs.network.push(answer.networkMs);
        theirs.alone.push(answer.aloneMs);
      }
    }
    if (answer) apart = difference(estimate, answer);
    estimate.close();
  }
  const network = summary(ours.network);
  const rivalNetwork = rival && summary(theirs.network);
  const figures = {
    runs,
    load_ms: loadMs,
    canonical_warp: summary(ours.warp),
    network,
    confidence: summary(ours.judge),
    frame: summary(ours.frame),
    rival: rival && {
      name: `onnxruntime-web ${rival.version}`,
      load_ms: rivalLoadMs,
      network: rivalNetwork,
      network_alone: summary(theirs.alone),
      ratio: network.median_ms / rivalNetwork.median_ms,
      difference: apart,
    },
  };
  return { sft, trained, figures };
}

/**
 * On the CPU, on one thread, and what follows the network.
 *
 * @param {{ runs: number, withOnnxRuntime: boolean }} options
 */
export async function measure({ runs, withOnnxRuntime }) {
  const { sft, trained, figures } = await takeTurns({ device: "cpu", warmUp: WARM_UP, runs, withOnnxRuntime });
  const { width, height, fx, fy, cx, cy } = trained;
  const mesh = await measureMesh(sft, { width, height, fx, fy, cx, cy });
  sft.close();
  return { browser: navigator.userAgent, threads: 1, ...figures, mesh };
}

/**
 * On the GPU, or what plays one.
 *
 * @param {{ runs: number, withOnnxRuntime: boolean }} options
 */
export async function measureOnGpu(options) {
  const { sft, figures } = await takeTurns({ device: "webgpu", warmUp: 1, ...options });
  const { adapterName, software } = sft.info;
  sft.close();
  return { adapter: adapterName, software, ...figures };
}
