// Inference in a browser, on its CPU and by WebGPU: this package beside onnxruntime-web with the same weights on the same
// frame, on the CPU both on one thread, taking turns. `cargo xtask bench` runs it:
//
//     node bench/browser.mjs MODEL_FOLDER EXPORT_FOLDER NETWORK.onnx ONNXRUNTIME_WEB_DIST RUNS
//
// EXPORT_FOLDER is what `deepsft-lab bench --export` wrote. Without NETWORK.onnx and ONNXRUNTIME_WEB_DIST ("-") only this
// package is measured. Prints one line of JSON.

import { join, normalize } from "node:path";

import { launch } from "../tests/support/browser.mjs";
import { serve } from "../serve.mjs";

/** Loading, and all frames of all runs. */
const PATIENCE_MS = 600_000;

/** Most measured frames by WebGPU. */
const GPU_RUNS = 5;

const [model, exported, network, onnxruntime, runs] = process.argv.slice(2);

/** Folders and files outside of www/, by the prefix of their address on the page's own origin. */
const PLACES = Object.entries({ "/bench-model/": model, "/bench-export/": exported, "/bench-onnxruntime/": onnxruntime });

/** @param {URL} url */
function fileOf({ pathname }) {
  if (pathname === "/bench-network.onnx") return network;
  const [prefix, folder] = PLACES.find(([prefix]) => pathname.startsWith(prefix)) ?? ["", ""];
  return join(folder, normalize(`/${decodeURIComponent(pathname.slice(prefix.length))}`));
}

const server = await serve();
const options = { runs: Number(runs), withOnnxRuntime: network !== "-" && onnxruntime !== "-" };

/** What page.js's function `name` gives in a browser of its own. */
async function inBrowser(webgpu, name, options) {
  const browser = await launch({ webgpu });
  try {
    const page = await browser.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    page.on("console", (message) => console.error(`browser: ${message.text()}`));
    await page.route(/\/bench-[a-z]+[./]/, (route) => route.fulfill({ path: fileOf(new URL(route.request().url())) }));
    // An empty page of the site: nothing but the measurement runs on it.
    await page.route("**/bench-blank", (route) => route.fulfill({ contentType: "text/html", body: "<!doctype html>" }));
    await page.goto(`${server.origin}/bench-blank`);
    const measure = page.evaluate(
      async ([name, options]) => (await import("/bench/page.js"))[name](options),
      /** @type {const} */ ([name, options]),
    );
    const late = new Promise((_, reject) => setTimeout(reject, PATIENCE_MS, new Error("the browser took too long")).unref());
    return await Promise.race([measure, late]);
  } finally {
    await browser.close();
  }
}

try {
  const figures = await inBrowser(false, "measure", options);
  // A program that plays a GPU takes seconds for a frame.
  const webgpu = await inBrowser(true, "measureOnGpu", { ...options, runs: Math.min(options.runs, GPU_RUNS) });
  console.log(JSON.stringify({ ...figures, webgpu }));
} finally {
  await server.close();
}
