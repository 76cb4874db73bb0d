// Two prints that nothing was trained for, followed at once before Chromium's camera at 30 frames per second, while a third is
// looked for in vain. By hand, on a machine that does nothing else:
//
//     DEEPSFT_CLI=target/release/deepsft node bench/targets.mjs [SECONDS]
//
// Prints one line of JSON.

import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { onPage } from "../tests/support/page.mjs";
import { PRINTS, thereAndBack, twoPrints } from "../tests/support/two-prints.mjs";
import { y4m } from "../tests/support/y4m.mjs";

const FRAMES = 60;
const CAMERA_FPS = 30;
/** What starts the tracks is not measured, seconds. */
const WARM_UP_S = 10;

const seconds = Number(process.argv[2] ?? 20);
const folder = await mkdtemp(join(tmpdir(), "deepsft-bench-"));
try {
  const { camera, shown, pngs } = await twoPrints(folder, FRAMES);
  const film = join(folder, "camera.y4m");
  await writeFile(film, y4m(thereAndBack(shown), CAMERA_FPS));
  const prepare = (context) => context.grantPermissions(["camera"]);
  await onPage({ webgpu: false, camera: film, prepare }, async ({ page }) => {
    const measure = async ([prints, files, camera, warmUpS, seconds]) => {
      const sft = await deepsft.DeepSft.load();
      const addMs = [];
      for (const [i, { name, widthMm }] of prints.entries()) {
        const began = performance.now();
        const picture = new Blob([Uint8Array.from(atob(files[i]), (c) => c.charCodeAt(0))]);
        await sft.addPicture(picture, { widthMm, name });
        addMs.push(performance.now() - began);
      }
      const video = document.body.appendChild(document.createElement("video"));
      const stream = await deepsft.openCamera(video);
      const alone = [];
      for (const target of sft.targets) {
        await sft.estimate(video, { camera, target }).then(({ times }) => alone.push(times.featuresMs));
      }
      const frames = [];
      const tracking = sft.trackMesh(
        video,
        (tracked) => {
          const followed = tracked.targets.filter(({ found, held }) => found && !held).length;
          frames.push({ at: performance.now(), followed, trackMs: tracked.times.trackMs, findersPerS: tracked.networkFps });
          tracked.close();
        },
        { camera },
      );
      await new Promise((resolve) => setTimeout(resolve, 1000 * (warmUpS + seconds)));
      tracking.stop();
      stream.stop();
      sft.close();
      const measured = frames.filter(({ at }) => at > frames.at(-1).at - 1000 * seconds);
      const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];
      const lastS = (measured.at(-1).at - measured[0].at) / 1000;
      return {
        add_ms: addMs,
        estimate_ms: alone,
        frames_per_s: (measured.length - 1) / lastS,
        both_followed: measured.filter(({ followed }) => followed === 2).length / measured.length,
        track_ms: median(measured.map(({ trackMs }) => trackMs)),
        finders_per_s: median(measured.map(({ findersPerS }) => findersPerS)),
        longest_gap_ms: Math.max(...measured.slice(1).map(({ at }, i) => at - measured[i].at)),
      };
    };
    console.log(JSON.stringify(await page.evaluate(measure, [PRINTS, pngs, camera, WARM_UP_S, seconds])));
  });
} finally {
  await rm(folder, { recursive: true, force: true });
}
