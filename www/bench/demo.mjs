// The demo page following its clip before a visitor without a GPU: the processor plays the video, looks for the poster, follows it and
// draws. The poster's network looks for it, which the page by itself does without. `cargo xtask bench` runs it:
//
//     node bench/demo.mjs SECONDS [FOLDER]
//
// FOLDER has another clip: the film in the file `webm`, its camera in `json`. Prints one line of JSON. Processor time is told on
// Linux only.

import { readFileSync, readdirSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { launchWithProfile } from "../tests/support/browser.mjs";
import { FOLDERS, serve } from "../serve.mjs";

const WINDOW = { width: 1280, height: 720 };
/** The page stands open for so long before the click, and follows for so long before it is measured, milliseconds. */
const READING_MS = 1500;
const WARM_UP_MS = 4000;
/** The first visitor stays for so long: only then does the browser keep the engine's compiled code. Visits from a warm cache follow. */
const FIRST_STAY_MS = 8000;
const WARM_VISITS = 2;
const PATIENCE_MS = 120_000;
/** The page's workers, in the order in which it starts them. */
const WORKERS = ["finders' worker", "tracker's worker"];
/** Linux counts the time of threads in these, milliseconds. */
const TICK_MS = 10;

const [seconds, clip] = process.argv.slice(2);

/** On the page: notes when the button is clicked, and each frame and answer. */
function note() {
  Object.assign(globalThis, { clickedAt: Number.NaN, frames: [], answers: [] });
  const button = document.querySelector("#use-clip");
  button.addEventListener("click", ({ timeStamp }) => (globalThis.clickedAt = timeStamp), { capture: true });
  document.addEventListener("deepsft-tracked", ({ tracked: { found, times } }) => frames.push({ at: performance.now(), found, times }));
  document.addEventListener("deepsft-estimate", ({ estimate: { found, times } }) => answers.push({ at: performance.now(), found, times }));
}

/** On the page: milliseconds from the click to the first answer and the first mesh; null before. */
function first() {
  const [answer, mesh] = [answers, frames].map((all) => all.find(({ found }) => found));
  return answer && mesh ? { answer_ms: answer.at - clickedAt, mesh_ms: mesh.at - clickedAt } : null;
}

/**
 * Processor time so far of the threads of this program's browser, by thread, and what each does for the page.
 *
 * @returns {Map<string, { group: string, ms: number }>} empty elsewhere than on Linux
 */
function processorTimes() {
  const threads = new Map();
  if (process.platform !== "linux") return threads;
  const statOf = (path) => {
    const stat = readFileSync(path, "utf8");
    const end = stat.lastIndexOf(")");
    return { name: stat.slice(stat.indexOf("(") + 1, end), fields: stat.slice(end + 2).split(" ") };
  };
  /** Processes that this one started, and those that they did. */
  const ours = new Set([String(process.pid)]);
  const processes = readdirSync("/proc").filter((name) => /^\d+$/.test(name));
  for (const id of processes.sort((a, b) => a - b)) {
    try {
      if (!ours.has(statOf(`/proc/${id}/stat`).fields[1])) continue;
      ours.add(id);
      const kind = /--type=([a-z-]+)/.exec(readFileSync(`/proc/${id}/cmdline`, "utf8"))?.[1] ?? "browser";
      const workers = [...WORKERS];
      for (const thread of readdirSync(`/proc/${id}/task`).sort((a, b) => a - b)) {
        const { name, fields } = statOf(`/proc/${id}/task/${thread}/stat`);
        let group = "video and the rest of the browser";
        if (kind === "gpu-process") group = "drawing";
        else if (name.startsWith("DedicatedWorker")) group = workers.shift() ?? group;
        else if (kind === "renderer" && thread === id) group = "page";
        threads.set(`${id} ${thread}`, { group, ms: TICK_MS * (Number(fields[11]) + Number(fields[12])) });
      }
    } catch {
      // It has ended.
    }
  }
  return threads;
}

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];
const medians = (times) => Object.fromEntries(Object.keys(times[0] ?? {}).map((name) => [name, median(times.map((one) => one[name]))]));

/** Opens the page, clicks, and stays for `stay` milliseconds, or measures for `seconds`. */
async function visit(context, origin, { stay = 0, seconds = 0 }) {
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  page.on("console", (message) => message.type() === "error" && console.error(`browser: ${message.text()}`));
  await page.goto(`${origin}/?model=models/poster-a4/`);
  await page.waitForTimeout(READING_MS);
  await page.evaluate(note);
  await page.click("#use-clip");
  const figures = await (await page.waitForFunction(first, undefined, { polling: 50 })).jsonValue();
  await page.waitForTimeout(stay);
  if (seconds > 0) Object.assign(figures, await followed(page, seconds));
  await page.close();
  return figures;
}

/** What the page does in so many seconds. */
async function followed(page, seconds) {
  const before = processorTimes();
  const from = await page.evaluate(() => ((frames.length = answers.length = 0), performance.now()));
  await page.waitForTimeout(1000 * seconds);
  const seen = await page.evaluate((from) => ({ seconds: (performance.now() - from) / 1000, frames, answers }), from);
  return {
    seconds: seen.seconds,
    frames_per_second: seen.frames.length / seen.seconds,
    found_per_second: seen.frames.filter(({ found }) => found).length / seen.seconds,
    answers_per_second: seen.answers.length / seen.seconds,
    frame_parts_ms: medians(seen.frames.map(({ times }) => times)),
    answer_parts_ms: medians(seen.answers.map(({ times }) => times)),
    processor_ms_per_frame: spent(before, processorTimes(), seen.frames.length),
  };
}

/** Milliseconds per frame by what they were spent on, the most first, and in all. */
function spent(before, after, frames) {
  if (after.size === 0) return {};
  const groups = {};
  for (const [id, { group, ms }] of after) groups[group] = (groups[group] ?? 0) + (ms - (before.get(id)?.ms ?? 0)) / frames;
  const all = Object.values(groups).reduce((sum, ms) => sum + ms, 0);
  return { all, ...Object.fromEntries(Object.entries(groups).filter(([, ms]) => ms >= 0.1).sort(([, a], [, b]) => b - a)) };
}

const server = await serve({ folders: clip ? { "/demo/clip.": clip, ...FOLDERS } : FOLDERS });
const profile = await mkdtemp(join(tmpdir(), "deepsft-demo-"));
const browser = await launchWithProfile(profile, { webgpu: false, viewport: WINDOW });
try {
  const cold = await visit(browser, server.origin, { stay: FIRST_STAY_MS });
  const warm = [];
  for (let i = 0; i < WARM_VISITS; i++) warm.push(await visit(browser, server.origin, {}));
  const { answer_ms, mesh_ms, ...figures } = await visit(browser, server.origin, { stay: WARM_UP_MS, seconds: Number(seconds) });
  const first_ms = { cold: cold.mesh_ms, warm: median([...warm.map(({ mesh_ms }) => mesh_ms), mesh_ms]) };
  const first_answer_ms = { cold: cold.answer_ms, warm: median([...warm.map(({ answer_ms }) => answer_ms), answer_ms]) };
  console.log(JSON.stringify({ window: WINDOW, first_mesh_ms: first_ms, first_answer_ms, ...figures }));
} finally {
  await browser.close();
  await server.close();
  await rm(profile, { recursive: true, force: true });
}
