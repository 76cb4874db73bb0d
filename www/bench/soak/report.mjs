// Samples of what a page holds: in a file, as curves, and judged.

import { writeFile } from "node:fs/promises";
import { join } from "node:path";

import { launch } from "../../tests/support/browser.mjs";

/** @import { Footprint } from "../../tests/support/footprint.mjs" */

/** By so much of what it was a quantity may grow. */
const MAX_GROWTH = 0.02;
/** The median of so many last samples is judged. */
const LAST = 3;
const MB = 1e6;

/** @param {number[]} values */
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

/** What a page and its workers hold together. */
const together = (/** @type {string} */ what) => ({ page, engine, tracker }) => page[what] + (engine?.[what] ?? 0) + (tracker?.[what] ?? 0);

/** What must not grow. @type {Record<string, (of: Footprint) => number>} */
const JUDGED = {
  "page: heap, MB": ({ page }) => page.heapBytes / MB,
  "engine: heap, MB": ({ engine }) => (engine?.heapBytes ?? 0) / MB,
  "tracker: heap, MB": ({ tracker }) => (tracker?.heapBytes ?? 0) / MB,
  "engine: wasm, MB": ({ engine }) => (engine?.wasmBytes ?? 0) / MB,
  "tracker: wasm, MB": ({ tracker }) => (tracker?.wasmBytes ?? 0) / MB,
  "array buffers, MB": (of) => together("arrayBytes")(of) / MB,
  "GPU buffers, MB": (of) => together("gpuBytes")(of) / MB,
  "GPU buffers and textures": (of) => together("gpuObjects")(of) + together("gpuTextures")(of),
  "WebGL buffers and textures": (of) => together("webglBuffers")(of) + together("webglTextures")(of),
  "DOM nodes": ({ nodes }) => nodes,
  listeners: ({ listeners }) => listeners,
  workers: ({ workers }) => workers,
};

/** What is only told: pictures on their way, and memory that the system has not taken back yet. @type {typeof JUDGED} */
const TOLD = {
  "open bitmaps": together("bitmaps"),
  "open video frames": together("videoFrames"),
  "renderer processes, MB": ({ rendererBytes }) => rendererBytes / MB,
  "GPU process, MB": ({ gpuProcessBytes }) => gpuProcessBytes / MB,
};
const COLUMNS = { ...JUDGED, ...TOLD };

const CHART = { width: 1000, height: 420, left: 60, right: 220, top: 40, bottom: 40 };
/** Of the value that is compared with, what the chart shows below and above. */
const SHOWN = { least: 0.9, most: 1.1 };

/** Samples that belong together: of one browser. */
class Part {
  #began = performance.now();
  /** @type {{ at: number, event: string, seconds: number, values: number[] }[]} */
  samples = [];

  /**
   * @param {string} name
   * @param {string} unit of what is counted
   */
  constructor(name, unit) {
    [this.name, this.unit] = [name, unit];
  }

  /**
   * @param {Footprint} footprint
   * @param {number} at how much was done
   * @param {string} [event] after which it was taken
   */
  add(footprint, at, event = "") {
    const values = Object.values(COLUMNS).map((of) => of(footprint));
    this.samples.push({ at, event, seconds: (performance.now() - this.#began) / 1000, values });
    console.error(`${this.name}: ${at} ${this.unit} ${event}  ${values.map((value) => value.toFixed(2).replace(/\.00$/, "")).join(" ")}`);
  }
}

/** What was seen in all parts. */
export class Report {
  #folder;
  /** @type {Part[]} */
  #parts = [];
  /** @type {string[]} */
  failures = [];

  /** @param {string} folder to write to */
  constructor(folder) {
    this.#folder = folder;
  }

  /**
   * @param {string} name
   * @param {string} unit
   */
  part(name, unit) {
    const part = new Part(name, unit);
    this.#parts.push(part);
    return part;
  }

  /** @param {boolean} holds @param {string} failure */
  expect(holds, failure) {
    if (holds) return;
    this.failures.push(failure);
    console.log(`FAILED: ${failure}`);
  }

  /**
   * Compares what was held in the first of some samples of a part with what was held in the others, and prints it.
   *
   * @param {string} title
   * @param {Part} part
   * @param {(sample: { at: number, event: string }) => boolean} chosen
   * @param {{ firsts?: number }} [options] the median of so many first samples stands for the first: where each has a worker of its own
   */
  judge(title, { unit, samples }, chosen, { firsts = 1 } = {}) {
    const all = samples.filter(chosen);
    const later = all.slice(firsts);
    const after = later.at(-1);
    if (!after) return this.expect(false, `${title}: too few samples`);
    const first = all.slice(0, firsts);
    const before = { at: first[0].at, values: first[0].values.map((_, i) => median(first.map(({ values }) => values[i]))) };
    const start = firsts > 1 ? `the median of ${firsts} samples from ${before.at} ${unit} on` : `${before.at} ${unit}`;
    console.log(`\n${title}: at ${start}, at ${after.at}, most in between`);
    for (const [i, column] of Object.keys(COLUMNS).entries()) {
      const most = Math.max(...later.map(({ values }) => values[i]));
      const figures = [before.values[i], after.values[i], most];
      if (figures.every((figure) => figure === 0)) continue;
      // What is compiled just now, or finalised next, makes single samples tremble.
      const lasting = median(later.slice(-LAST).map(({ values }) => values[i]));
      const growth = lasting / before.values[i] - 1;
      const percent = `${growth >= 0 ? "+" : ""}${(100 * growth).toFixed(1)} %`;
      console.log([column.padEnd(28), ...figures.map((figure) => figure.toFixed(2).padStart(9)), percent.padStart(9)].join(" "));
      if (column in JUDGED) this.expect(growth <= MAX_GROWTH, `${title}: ${column} grew by ${percent} after ${start}`);
    }
  }

  /** Writes samples.csv and a curve of each part. */
  async write() {
    const rows = this.#parts.flatMap(({ name, samples }) =>
      samples.map(({ at, event, seconds, values }) => [name, at, event, seconds.toFixed(1), ...values.map((value) => Number(value.toFixed(3)))]),
    );
    const table = [["part", "at", "after", "seconds", ...Object.keys(COLUMNS)], ...rows];
    await writeFile(join(this.#folder, "samples.csv"), table.map((row) => row.map((cell) => JSON.stringify(cell)).join()).join("\n") + "\n");
    const browser = await launch({ webgpu: false });
    try {
      const page = await browser.newPage({ viewport: CHART });
      for (const part of this.#parts.filter(({ samples }) => samples.length > 1)) {
        await page.setContent(`<body style="margin:0">${chart(part)}`);
        await page.screenshot({ path: join(this.#folder, `${part.name}.png`) });
      }
    } finally {
      await browser.close();
    }
  }
}

/** What is judged as curves, each in relation to its median. @param {Part} part */
function chart({ name, unit, samples }) {
  const { width, height, left, right, top, bottom } = CHART;
  const last = samples.at(-1).at;
  const x = (/** @type {number} */ at) => left + (at / last) * (width - left - right);
  const y = (/** @type {number} */ share) => {
    const within = Math.min(Math.max(share, SHOWN.least), SHOWN.most);
    return top + ((SHOWN.most - within) / (SHOWN.most - SHOWN.least)) * (height - top - bottom);
  };
  const lines = [];
  for (const [i, column] of Object.keys(JUDGED).entries()) {
    const middle = median(samples.map(({ values }) => values[i]));
    if (middle === 0) continue;
    const colour = `hsl(${Math.round((360 * i) / Object.keys(JUDGED).length)} 70% 40%)`;
    const points = samples.map(({ at, values }) => `${x(at).toFixed(1)},${y(values[i] / middle).toFixed(1)}`);
    lines.push(
      `<polyline points="${points.join(" ")}" fill="none" stroke="${colour}" stroke-width="1.5"/>`,
      `<text x="${width - right + 12}" y="${top + 18 * lines.length / 2 + 8}" fill="${colour}">${column}: ${middle.toPrecision(4)}</text>`,
    );
  }
  const grid = [0.9, 0.95, 0.98, 1, 1.02, 1.05, 1.1].map(
    (share) =>
      `<line x1="${left}" x2="${width - right}" y1="${y(share)}" y2="${y(share)}" stroke="#ccc"/><text x="8" y="${y(share) + 4}">${Math.round(100 * share)} %</text>`,
  );
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((part) => `<text x="${x(part * last)}" y="${height - 14}" text-anchor="middle">${Math.round(part * last)}</text>`);
  const title = `<text x="${left}" y="20" font-weight="bold">${name}: of the median, over ${unit}</text>`;
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" font-family="sans-serif" font-size="12">${[title, ...grid, ...ticks, ...lines].join("")}</svg>`;
}
