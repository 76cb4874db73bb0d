// The film on the start screen: the page's own scene on the bundled clip, frame by frame; and the poster as small as the page looks at it. Needs
// ffmpeg, and a built page (`cargo xtask web`).
//
//     node film.mjs
//
// writes demo/hero.mp4, demo/hero.jpg and demo/poster.webp.

import { execFileSync } from "node:child_process";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

import { launch, openDemo } from "./tests/support/browser.mjs";

const FPS = 20;
const SIZE = { width: 640, height: 360 };
/** What is shown from which second on, and how long the clip is. */
const SHOWN = [
  { from: 0, overlay: "plain" },
  { from: 1.6, overlay: "paper", paper: "aurora" },
  { from: 4.2, overlay: "paper", paper: "ink" },
  { from: 5.8, overlay: "object", object: "house" },
];
const LENGTH_S = 8;

const demo = (name) => fileURLToPath(new URL(`demo/${name}`, import.meta.url));
const folder = await mkdtemp(join(tmpdir(), "deepsft-film-"));
const browser = await launch({ webgpu: false });
try {
  const { page } = await openDemo(browser, { device: { viewport: SIZE }, query: "?device=cpu" });
  let count = 0;
  await page.exposeFunction("keep", (base64) => writeFile(join(folder, `${String(count++).padStart(4, "0")}.png`), Buffer.from(base64, "base64")));
  await page.evaluate(
    async ({ shown, fps, length }) => {
      const [{ DeepSft }, { start }, { Overlays }] = await Promise.all([import("deepsft"), import("deepsft/scene"), import("/demo/live/overlays.js")]);
      const { camera } = await (await fetch("/demo/clip.json")).json();
      const video = Object.assign(document.createElement("video"), { muted: true, src: "/demo/clip.mp4" });
      await new Promise((resolve) => video.addEventListener("loadeddata", resolve));
      const sft = await DeepSft.load("/models/poster-a4/", { device: "cpu" });
      const container = document.createElement("div");
      container.style.cssText = "position: fixed; inset: 0; z-index: 9";
      document.body.append(container);
      let drawn;
      async function* frames() {
        for (let i = -fps; i < length * fps; i++) {
          const seeked = new Promise((resolve) => video.addEventListener("seeked", resolve, { once: true }));
          video.currentTime = Math.max(0, i / fps + 0.001);
          await seeked;
          const done = new Promise((resolve) => (drawn = { i, resolve }));
          yield { frame: await createImageBitmap(video), timeMs: ((i + fps) * 1000) / fps };
          await done;
        }
      }
      const view = await start(container, { sft, source: frames(), camera, screens: false, sound: false, smooth: true });
      // The whole picture by WebGL, smooth.
      view.software = false;
      const overlays = new Overlays(view, sft.targets[0], container, new AbortController().signal);
      let [number, last] = [0, null];
      await new Promise((resolve) =>
        view.addEventListener("frame", ({ detail: { frame } }) => {
          if (frame.number === number) return;
          number = frame.number;
          const { i } = drawn;
          const now = shown.findLast(({ from }) => i / fps >= from) ?? shown[0];
          if (now !== last) overlays.show({ paper: "aurora", object: "house", ...now });
          last = now;
          overlays.follow(frame.mesh, { near: 0, far: 1, step: 1 });
          const { resolve: next } = drawn;
          setTimeout(async () => {
            if (i >= 0) {
              const bytes = new Uint8Array(await (await view.shot()).arrayBuffer());
              let text = "";
              for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
              await keep(btoa(text));
            }
            next();
            if (i === length * fps - 1) resolve();
          });
        }),
      );
    },
    { shown: SHOWN, fps: FPS, length: LENGTH_S },
  );
  const ffmpeg = (...options) => execFileSync("ffmpeg", ["-y", "-v", "error", ...options]);
  const h264 = ["-c:v", "libx264", "-preset", "veryslow", "-crf", "30", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-an"];
  ffmpeg("-framerate", String(FPS), "-i", join(folder, "%04d.png"), ...h264, demo("hero.mp4"));
  ffmpeg("-i", demo("../../models/poster-a4/template/texture.png"), "-vf", "scale=1024:724:flags=lanczos", "-quality", "75", demo("poster.webp"));
  ffmpeg("-ss", "3", "-i", demo("hero.mp4"), "-frames:v", "1", "-q:v", "6", demo("hero.jpg"));
} finally {
  await browser.close();
  await rm(folder, { recursive: true, force: true });
}
process.exit(0);
