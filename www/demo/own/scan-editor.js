// A person's own scan on its way to the library: its shape, which turns, its size, and what will work with it.

import { part } from "../part.js";
import { MIN_MM, MAX_MM, formatLength, isUsableLength, parseLength } from "./print-size.js";
import { MAX_PICTURE_LENGTH, canvasOf, contextOf, shrunk } from "./read-picture.js";

/** @import { Scan } from "deepsft" */
/** @import { Orbit } from "../graphics/orbit.js" */
/** @import { ReadyPicture } from "./picture-editor.js" */

/** Longest side of the small flat picture beside the size, CSS pixels, twice for dense screens. */
const PREVIEW_LENGTH = 2 * 64;

/** A sheet whose longer side is shorter or longer than this was probably measured in another unit, mm. */
const LIKELY_MM = [40, 2000];

const SHEET_WORDS = "This is a sheet: it will be found, followed and measured, however it bends. Below it is laid flat.";
const BACK_WORDS = " It was scanned from both sides: the one with more on it was taken.";
const VOLUME_WORDS =
  "This page follows sheets: paper, labels, plates, however bent. What has a volume is followed by programs: on the command line, and by " +
  "sft.addScan in pages.";

export class ScanEditor {
  #root = part("#scan");
  #width = part("#scan-width", HTMLInputElement);
  #height = part("#scan-height");
  #problem = part("#scan-problem");
  /** @type {Orbit | null} */
  #orbit = null;
  /** @type {Scan | null} */
  #scan = null;
  /** mm; NaN where none was said. */
  #widthMm = Number.NaN;
  #request = 0;
  /** @type {(picture: ReadyPicture, use: "camera" | "image") => void} */
  onReady = () => undefined;

  constructor() {
    this.#width.addEventListener("input", () => this.#take(parseLength(this.#width.value, "mm")));
    this.#width.addEventListener("change", () => this.#width.value && this.#widthMm > 0 && (this.#width.value = formatLength(this.#widthMm, "mm")));
    part("#scan form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#finish(event.submitter instanceof HTMLButtonElement && event.submitter.value === "image" ? "image" : "camera");
    });
  }

  /** Shows that a scan is being read. @param {string} name of its file */
  wait(name) {
    this.close();
    this.#root.hidden = false;
    this.#root.dataset.state = "reading";
    part("#scan-name").textContent = name;
    part("#scan-verdict").textContent = "Reading your scan";
    part("#scan h2").focus({ preventScroll: true });
  }

  /** @param {Scan} scan */
  open(scan) {
    this.#root.hidden = false;
    this.#scan = scan;
    this.#root.dataset.state = scan.sheet ? "sheet" : "volume";
    part("#scan-name").textContent = scan.name;
    const reason = scan.refusal ? ` ${sentence(scan.refusal)}` : "";
    part("#scan-verdict").textContent = scan.sheet ? `${SHEET_WORDS}${scan.sheet.backMm === null ? "" : BACK_WORDS}` : `${VOLUME_WORDS}${reason}`;
    this.#sayBox(1);
    if (scan.sheet) {
      this.#take(scan.sheet.widthMm);
      this.#width.value = formatLength(scan.sheet.widthMm, "mm");
      shrunk(drawn(scan.sheet.picture), PREVIEW_LENGTH, part("#scan-flat", HTMLCanvasElement));
      const longest = Math.max(scan.sheet.widthMm, scan.sheet.heightMm);
      if (longest < LIKELY_MM[0] || longest > LIKELY_MM[1]) this.#say("Is that right? Some files name no unit, or the wrong one. Measure the sheet.");
    }
    void this.#turn(scan);
  }

  close() {
    this.#root.hidden = true;
    cancelAnimationFrame(this.#request);
    this.#scan = null;
    this.#say("");
  }

  /** Shows the scan, which turns. @param {Scan} scan */
  async #turn(scan) {
    const { orbitOn } = await import("../graphics/orbit.js");
    if (this.#scan !== scan) return;
    const orbit = (this.#orbit ??= orbitOn(part("#scan-shape", HTMLCanvasElement)));
    if (!orbit) return;
    const [width, height, depth] = scan.sizeMm;
    orbit.reset();
    orbit.setTemplate({ texture: scan.texture, mesh: scan.mesh, widthMm: Math.hypot(width, depth), heightMm: height });
    const draw = () => {
      orbit.show(scan);
      this.#request = requestAnimationFrame(draw);
    };
    draw();
  }

  /** @param {number} widthMm NaN where it is no length */
  #take(widthMm) {
    const { sheet } = /** @type {Scan} */ (this.#scan);
    this.#widthMm = widthMm;
    this.#say("");
    if (sheet && widthMm > 0) this.#sayBox(widthMm / sheet.widthMm);
    this.#height.textContent = sheet && widthMm > 0 ? formatLength((widthMm * sheet.heightMm) / sheet.widthMm, "mm") : "–";
  }

  /** Says how large the scan is as it stands. @param {number} scale by which its size was corrected */
  #sayBox(scale) {
    const sides = this.#scan?.sizeMm.map((side) => formatLength(scale * side, "mm")).join(" × ");
    part("#scan-box").textContent = [`The scan measures ${sides} mm.`, ...(this.#scan?.notes ?? []).map(sentence)].join(" ");
  }

  /** @param {"camera" | "image"} use */
  #finish(use) {
    const { sheet, name } = /** @type {Scan} */ (this.#scan);
    if (!sheet) return;
    const [widthMm, heightMm] = [this.#widthMm, (this.#widthMm * sheet.heightMm) / sheet.widthMm];
    if (![widthMm, heightMm].every(isUsableLength)) {
      this.#say(`How wide is the sheet, laid flat? Sheets of ${MIN_MM} mm to ${MAX_MM / 1000} m a side can be followed.`);
      return this.#width.focus();
    }
    const canvas = shrunk(drawn(sheet.picture), MAX_PICTURE_LENGTH);
    this.onReady({ canvas, name, widthMm, heightMm, hasSize: true }, use);
  }

  /** @param {string} problem empty for none */
  #say(problem) {
    this.#problem.textContent = problem;
    this.#width.setAttribute("aria-invalid", String(problem !== ""));
  }
}

/** @param {string} clause without a capital and a full stop */
function sentence(clause) {
  return `${clause[0].toUpperCase()}${clause.slice(1)}.`;
}

/** @param {ImageData} picture */
function drawn(picture) {
  const canvas = canvasOf(picture.width, picture.height);
  contextOf(canvas).putImageData(picture, 0, 0);
  return canvas;
}
