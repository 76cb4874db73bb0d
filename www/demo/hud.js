// The figures beside the picture: rate, stage times, device, camera.

import { depthTicks, heatGradient } from "./heat.js";

/** @import { EngineInfo, Estimate, SourcedCamera } from "deepsft" */

/** Seconds over which the figures are averaged, so that they can be read. */
const MEAN_SECONDS = 1.5;

/** Where intrinsics come from, in words. */
const SOURCE_WORDS = {
  given: "given with the clip",
  calibrated: "calibrated here",
  estimated: "estimated, ±\u00a015\u00a0%",
};

/**
 * @param {number} parameters
 * @returns {string} such as "2.4 M"
 */
function millions(parameters) {
  return `${(parameters / 1e6).toFixed(1)} M`;
}

/**
 * @param {string} selector
 * @returns {HTMLElement}
 */
function element(selector) {
  const found = document.querySelector(selector);
  if (!(found instanceof HTMLElement)) throw new Error(`The page has no ${selector}.`);
  return found;
}

export class Hud {
  /** @type {Map<string, number>} running means by name */
  #means = new Map();
  #lastFrame = 0;
  #frames = 0;
  /** @type {EngineInfo | null} */
  #engine = null;

  /** Forgets the means of the last source. */
  reset() {
    this.#means.clear();
    this.#frames = 0;
    element("#fps").textContent = "–";
    element("#state").dataset.state = "waiting";
    element("#state-text").textContent = "Warming up";
  }

  /** @param {EngineInfo} info */
  showEngine(info) {
    if (info === this.#engine) return;
    this.#engine = info;
    const kind = info.device === "webgpu" ? (info.software ? "WebGPU (software)" : "WebGPU") : "CPU";
    element("#device").textContent = kind;
    element("#adapter").textContent = info.adapterName.replace(/^CPU \((.*)\)$/, "$1");
    element("#model").textContent = `${info.modelName}, ${millions(info.parameters)} parameters`;
    element("#fallback").textContent = info.fallback ? info.fallback.message : "";
    element("#fallback-row").hidden = !info.fallback;
  }

  /**
   * @param {Estimate} estimate
   * @param {number} drawMs time to hand the frame to the stage
   */
  showFrame(estimate, drawMs) {
    const { captureMs, warpMs, networkMs, judgeMs } = estimate.times;
    const stages = { capture: captureMs, warp: warpMs, network: networkMs, judge: judgeMs, draw: drawMs };
    const total = Object.values(stages).reduce((sum, ms) => sum + ms, 0);
    const now = performance.now();
    // Nothing to average with before the second frame: the first one is slow, as kernels are compiled.
    const interval = this.#frames > 1 ? now - this.#lastFrame : Infinity;
    const weight = 1 - Math.exp(-interval / 1000 / MEAN_SECONDS);
    for (const [name, ms] of Object.entries(stages)) {
      const mean = this.#mean(name, ms, weight);
      element(`#${name}-ms`).textContent = mean.toFixed(mean < 9.95 ? 1 : 0);
      element(`#${name}-bar`).style.flexGrow = String(ms / total);
    }
    if (this.#frames > 0) {
      const rate = 1000 / this.#mean("interval", now - this.#lastFrame, weight);
      element("#fps").textContent = rate.toFixed(rate < 9.95 ? 1 : 0);
    }
    this.#frames++;
    this.#lastFrame = now;
    this.#showState(estimate);
    this.#showCamera(estimate.camera);
  }

  /** @param {Estimate} estimate */
  #showState({ found, confidence }) {
    element("#state").dataset.state = found ? "found" : "missing";
    element("#state-text").textContent = found
      ? `Poster found · ${Math.round(100 * confidence)} %`
      : "Poster not found";
    element("#hint").hidden = found;
  }

  /** @param {SourcedCamera} camera */
  #showCamera({ width, height, fx, source }) {
    element("#frame-size").textContent = `${width} × ${height}`;
    element("#focal").textContent = `f ${fx.toFixed(0)} px`;
    element("#focal-source").textContent = SOURCE_WORDS[source];
    element("#camera-row").dataset.source = source;
  }

  /**
   * The colour bar of the depth map.
   *
   * @param {{ near: number, far: number }} range mm
   */
  showDepthScale(range) {
    const bar = element("#scale-bar");
    bar.style.setProperty("--scale-up", heatGradient("to top"));
    bar.style.setProperty("--scale-right", heatGradient("to right"));
    const labels = depthTicks(range, 5).ticks.map((tick) => {
      const label = document.createElement("span");
      label.textContent = String(tick);
      label.style.setProperty("--at", String((tick - range.near) / (range.far - range.near)));
      return label;
    });
    element("#scale-ticks").replaceChildren(...labels);
  }

  /**
   * @param {string} name
   * @param {number} value
   * @param {number} weight of the value against the mean so far
   */
  #mean(name, value, weight) {
    const before = this.#means.get(name) ?? value;
    const mean = before + weight * (value - before);
    this.#means.set(name, mean);
    return mean;
  }
}
