// The figures beside the picture: rate, stage times, device, camera.

import { depthTicks, heatGradient } from "../graphics/heat.js";
import { formatSize } from "../own/print-size.js";
import { part } from "../part.js";

/** @import { EngineInfo, Estimate, SourcedCamera, TrackedFrame } from "deepsft" */
/** @import { Subject } from "../subjects.js" */

/** Milliseconds for which figures stand: nobody reads faster, and each change makes the browser lay out the page again. */
const STAND_MS = 300;
const STAGES = /** @type {const} */ (["capture", "warp", "track", "network", "judge", "draw"]);
/** Seconds over which the figures are averaged, so that they can be read. */
const MEAN_SECONDS = 1.5;

/** What is said of a sheet that is there: the network sees it, or the tracker follows it. */
const STATE_WORDS = { found: "Found", tracked: "Tracked" };

/** Where intrinsics come from, in words. */
const SOURCE_WORDS = {
  given: "given with the clip",
  calibrated: "found here",
  exif: "by the photograph's EXIF data",
  estimated: "estimated, ±\u00a015\u00a0%",
};

/** What is said where it is not found, and what helps. */
const MISSING = {
  poster: ["Poster not found", "Show the whole sheet, in even light, 25 to 90\u00a0cm away."],
  tube: ["Tube not found", "Show the whole tube, in even light, 25 to 90\u00a0cm away."],
  picture: ["Looking for the picture", "Show the whole print, nearly flat at first, in even light, large in the picture."],
};

export class Hud {
  /** @type {Map<string, number>} running means by name */
  #means = new Map();
  #lastFrame = 0;
  #frames = 0;
  #answers = 0;
  #shownAt = -Infinity;
  /** @type {EngineInfo | null} */
  #engine = null;
  /** What is said of a sheet that is not there. */
  #missing = "";

  constructor() {
    const { style } = part("#scale-bar");
    style.setProperty("--scale-up", heatGradient("to top"));
    style.setProperty("--scale-right", heatGradient("to right"));
  }

  /** Forgets the means of the last source. */
  reset() {
    this.#means.clear();
    [this.#frames, this.#answers] = [0, 0];
    for (const name of ["fps", "network-fps", ...STAGES.map((name) => `${name}-ms`)]) part(`#${name}`).textContent = "–";
    this.showMesh(false);
    this.showWaiting("Warming up");
    this.#say("");
    for (const name of STAGES) part(`#${name}-bar`).style.flexGrow = "0";
    this.#shownAt = -Infinity;
  }

  /** @param {string} words while it is not known whether the sheet is there */
  showWaiting(words) {
    Object.assign(part("#state").dataset, { state: "waiting", how: "" });
    part("#state-text").textContent = words;
  }

  /** @param {Subject} subject what is looked for */
  showSubject(subject) {
    const { kind, target, hasSize } = subject;
    [this.#missing, part("#hint").textContent] = MISSING[kind];
    const size = hasSize ? formatSize(target.widthMm, target.heightMm) : "size not known";
    if (kind === "picture") part("#model").textContent = `${target.name}, ${size}`;
    part("#scale").dataset.unit = hasSize ? "mm" : "none";
    this.showEngine(subject);
  }

  /** @param {Subject} subject */
  showEngine({ kind, sft: { info } }) {
    if (kind !== "picture") part("#model").textContent = `${info.modelName}, ${(info.parameters / 1e6).toFixed(1)} M parameters`;
    if (info === this.#engine) return;
    this.#engine = info;
    const name = info.device === "webgpu" ? (info.software ? "WebGPU (software)" : "WebGPU") : "CPU";
    part("#device").textContent = name;
    part("#adapter").textContent = info.device === "cpu" ? "" : info.adapterName;
    part("#fallback").textContent = info.fallback ? info.fallback.message : "";
    part("#fallback-row").hidden = !info.fallback;
  }

  /**
   * The figures of a single picture.
   *
   * @param {Estimate} estimate
   * @param {number} drawMs time to hand the frame to the stage
   */
  showEstimate({ found, confidence, camera, times: { captureMs, warpMs, networkMs, featuresMs, judgeMs } }, drawMs) {
    const findMs = networkMs + featuresMs;
    this.#average({ capture: captureMs, warp: warpMs, network: findMs, judge: judgeMs, draw: drawMs }, 1);
    this.#showStages();
    this.#showState(found, "found", confidence);
    this.#showCamera(camera);
  }

  /**
   * The figures of a frame of a video.
   *
   * @param {TrackedFrame} tracked
   * @param {number} drawMs time to hand the frame to the stage
   */
  showTracked({ found, correlation, camera, networkFps, times: { captureMs, warpMs, trackMs } }, drawMs) {
    const now = performance.now();
    // Nothing to average with before the second frame: the first one is slow, as kernels are compiled.
    const interval = this.#frames > 1 ? now - this.#lastFrame : Infinity;
    const weight = 1 - Math.exp(-interval / 1000 / MEAN_SECONDS);
    this.#average({ capture: captureMs, warp: warpMs, track: trackMs, draw: drawMs }, weight);
    if (this.#frames > 0) this.#average({ interval: now - this.#lastFrame }, weight);
    this.#frames++;
    this.#lastFrame = now;
    const wasTracked = part("#state").dataset.how === "tracked";
    // What was found or lost is said at once, figures now and then.
    if (found === wasTracked && now - this.#shownAt < STAND_MS) return;
    this.#shownAt = now;
    const rate = 1000 / (this.#means.get("interval") ?? Infinity);
    if (rate > 0) part("#fps").textContent = rate.toFixed(rate < 9.95 ? 1 : 0);
    this.#showStages();
    this.showMesh(found);
    if (networkFps > 0 && this.#answers === 0) part("#network-fps").textContent = networkFps.toFixed(1);
    if (found) this.#showState(true, "tracked", correlation);
    else if (wasTracked) {
      // Until the network has said whether the sheet is still there.
      this.showWaiting("Looking again");
      this.#say("Looking again");
    }
    this.#showCamera(camera);
  }

  /** @param {boolean} there whether a mesh is drawn */
  showMesh(there) {
    part("#live").dataset.mesh = String(there);
  }

  /**
   * The figures of the network beside the tracker.
   *
   * @param {Estimate} estimate
   * @param {boolean} tracked whether the tracker has the sheet anyway
   * @param {number} fps answers per second
   */
  showAnswer({ found, confidence, times: { networkMs, judgeMs } }, tracked, fps) {
    const weight = this.#answers++ > 1 && fps > 0 ? 1 - Math.exp(-1 / fps / MEAN_SECONDS) : 1;
    this.#average({ network: networkMs, judge: judgeMs, ...(fps > 0 && { fps }) }, weight);
    if (fps > 0) part("#network-fps").textContent = (this.#means.get("fps") ?? fps).toFixed(1);
    if (!tracked) this.#showState(found, "found", confidence);
  }

  /**
   * @param {Record<string, number>} figures by their names
   * @param {number} weight of these against the means so far
   */
  #average(figures, weight) {
    for (const [name, value] of Object.entries(figures)) {
      const before = this.#means.get(name) ?? value;
      this.#means.set(name, before + weight * (value - before));
    }
  }

  #showStages() {
    const means = STAGES.map((name) => this.#means.get(name) ?? 0);
    const total = means.reduce((sum, ms) => sum + ms, 0);
    for (const [i, name] of STAGES.entries()) {
      const ms = means[i];
      if (!this.#means.has(name)) continue;
      part(`#${name}-bar`).style.flexGrow = String(ms / total);
      part(`#${name}-ms`).textContent = ms.toFixed(ms < 9.95 ? 1 : 0);
    }
  }

  /**
   * @param {boolean} found
   * @param {"found" | "tracked"} how by the network alone, or by the tracker
   * @param {number} fraction of the print that the image agrees with, 0 to 1
   */
  #showState(found, how, fraction) {
    Object.assign(part("#state").dataset, found ? { state: "found", how } : { state: "missing", how: "" });
    part("#state-text").textContent = found
      ? `${STATE_WORDS[how]} · ${Math.round(100 * fraction)} %`
      : this.#missing;
    this.#say(found ? "Found" : this.#missing);
    part("#hint").hidden = found;
  }

  /** To a screen reader, once. @param {string} words */
  #say(words) {
    if (part("#state-said").textContent !== words) part("#state-said").textContent = words;
  }

  /** The sheet has not been seen for a while. */
  showMissing() {
    this.#showState(false, "found", 0);
  }

  /** @param {SourcedCamera} camera */
  #showCamera({ width, height, fx, source, spread }) {
    part("#frame-size").textContent = `${width} × ${height}`;
    part("#focal").textContent = `f ${fx.toFixed(0)} px`;
    const sure = spread ? `, ±\u00a0${((100 * spread) / fx).toFixed(1)}\u00a0%` : "";
    part("#focal-source").textContent = `${SOURCE_WORDS[source]}${sure}`;
    part("#camera-row").dataset.source = source;
  }

  /**
   * The colour bar of the depth map.
   *
   * @param {{ near: number, far: number }} range mm
   */
  showDepthScale(range) {
    const labels = depthTicks(range, 5).ticks.map((tick) => {
      const label = document.createElement("span");
      label.textContent = String(tick);
      label.style.setProperty("--at", String((tick - range.near) / (range.far - range.near)));
      return label;
    });
    part("#scale-ticks").replaceChildren(...labels);
  }
}
