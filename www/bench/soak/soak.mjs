// Long life in Chromium: what the demo page and the package hold on to while they work for long, and after what can befall a page.
// `cargo xtask soak` runs it:
//
//     DEEPSFT_CLI=target/release/deepsft node bench/soak/soak.mjs [--frames N] [--every N] [--only PART,PART] [--out FOLDER] [--film FILE]
//
// FILE is a film of the poster (.y4m), made when absent. Parts: cpu and webgpu (the page before a camera for N frames, by default 10,000, then interrupted), cycles (things started and
// stopped again and again). Leaves samples.csv and a curve of each part in FOLDER. Fails when something has grown.

import { mkdir, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";

import { posterFilm } from "../../tests/support/followed-page.mjs";
import { beforeCamera } from "./before-camera.mjs";
import { againAndAgain } from "./again-and-again.mjs";
import { Report } from "./report.mjs";

/** The poster is moved and bent, an arm passes before it, it leaves and comes back: so many frames each. */
const SCENES = ["motion", "occlusion", "leaving"];
const SCENE_FRAMES = 90;
const FRAMES_PER_SECOND = 30;

const { values: options } = parseArgs({
  options: {
    frames: { type: "string", default: "10000" },
    every: { type: "string", default: "250" },
    only: { type: "string", default: "cpu,webgpu,cycles" },
    out: { type: "string", default: "soak" },
    film: { type: "string" },
  },
});
const [frames, every] = [options.frames, options.every].map(Number);
if (!(frames >= 1000 && every >= 1)) throw new Error("--frames wants 1000 or more, --every 1 or more");

const PARTS = {
  cpu: (film, report) => beforeCamera({ film, device: "cpu", frames, every }, report),
  webgpu: (film, report) => beforeCamera({ film, device: "webgpu", frames, every }, report),
  cycles: againAndAgain,
};
const parts = options.only.split(",");
for (const part of parts) if (!(part in PARTS)) throw new Error(`--only ${part}: there are ${Object.keys(PARTS).join(", ")}`);

await mkdir(options.out, { recursive: true });
const folder = await mkdtemp(join(tmpdir(), "deepsft-soak-"));
const report = new Report(options.out);
try {
  const film = options.film ?? (await posterFilm(folder, SCENES, SCENE_FRAMES, FRAMES_PER_SECOND));
  for (const part of parts) await PARTS[part](film, report);
} finally {
  await report.write();
  await rm(folder, { recursive: true, force: true });
}
process.exitCode = report.failures.length > 0 ? 1 : 0;
