// All that can be in the way of the page, each caused in a browser. Where a browser cannot be brought to refuse by itself, its
// refusal is handed to the page: the error is the browser's own.

import { cp, mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { networkInterfaces } from "node:os";
import { join } from "node:path";

import { FOLDERS, serve } from "../../serve.mjs";
import { MODEL } from "../support/native.mjs";
import { encodePng } from "../support/png.mjs";

/** @import { EnginePage } from "../support/engines.mjs" */

/**
 * @typedef {object} Refusal
 * @property {string} what is in the way, as a test's name
 * @property {string} code that the page is to say
 * @property {(page: EnginePage & { load: (address?: string) => Promise<void> }) => Promise<unknown>} cause it on the demo page, which
 *   `load` opens
 */

/**
 * What is served and shown to be refused.
 *
 * @param {string} folder to make it in
 */
export async function makeObstacles(folder) {
  const models = join(folder, "refused-models");
  const model = async (name, file, change) => {
    await cp(MODEL, join(models, name), { recursive: true });
    const changed = join(models, name, file);
    const bytes = change(await readFile(changed));
    await (bytes === null ? rm(changed) : writeFile(changed, bytes));
  };
  await model("damaged", "weights.bpk", (bytes) => ((bytes[bytes.length >> 1] ^= 1), bytes));
  await model("incomplete", "weights.bpk", () => null);
  await model("newer", "model.json", (bytes) => JSON.stringify({ ...JSON.parse(bytes), format_version: 99 }));
  const nothing = join(folder, "nothing");
  await mkdir(nothing);
  const files = {
    "broken.png": Buffer.from("no picture"),
    "small.png": encodePng({ width: 40, height: 40, values: new Uint8Array(3 * 40 * 40).fill(90) }),
    "blank.png": encodePng({ width: 300, height: 200, values: new Uint8Array(3 * 300 * 200).fill(120) }),
    "see-through.svg": '<svg xmlns="http://www.w3.org/2000/svg" width="300" height="200"/>',
  };
  for (const [name, bytes] of Object.entries(files)) await writeFile(join(folder, name), bytes);
  // Browsers take this machine's own name for secure, but not its address in the network.
  const addresses = Object.values(networkInterfaces()).flat();
  const host = addresses.find(({ family, internal }) => family === "IPv4" && !internal)?.address;
  if (!host) throw new Error("this machine is in no network: nothing here is insecure");
  const [open, refused, engineless] = await Promise.all([
    serve({ host }),
    serve({ folders: { ...FOLDERS, "/models/": models } }),
    serve({ folders: { "/dist/": nothing, ...FOLDERS } }),
  ]);
  const servers = [open, refused, engineless];
  return {
    open,
    refused,
    engineless,
    file: (name) => join(folder, name),
    close: () => Promise.all(servers.map((server) => server.close())),
  };
}

/** The browser's own error in place of its camera. */
const rejectedBy = (replace) => async (page) => {
  await page.load();
  await page.run(replace);
  await page.click("#use-camera");
};

const wantsCamera = async (page) => {
  await page.load();
  await page.click("#use-camera");
};

/**
 * What a browser says that may not, or cannot, show a camera.
 *
 * @param {string} engine
 * @returns {{ denied: Refusal, missing: Refusal }} in browsers that were opened so
 */
export function refusedCameras(engine) {
  // WebKit's driver cannot refuse.
  const denied = () => {
    navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("Permission denied", "NotAllowedError"));
  };
  return {
    denied: { what: "a camera that is not allowed is named", code: "camera-denied", cause: engine === "webkit" ? rejectedBy(denied) : wantsCamera },
    missing: { what: "a machine without a camera is told so", code: "camera-not-found", cause: wantsCamera },
  };
}

/**
 * @param {() => Awaited<ReturnType<typeof makeObstacles>>} obstacles once they are made
 * @returns {Refusal[]} all that a browser with a camera can be made to refuse
 */
export function refusals(obstacles) {
  const image = async (page, address) => {
    const { origin } = obstacles().refused;
    await page.load(`${origin}/?device=cpu&model=models/${address}/`);
    await page.choose("#image-file", obstacles().file("blank.png"));
  };
  const picture = (name) => async (page) => {
    await page.load();
    await page.choose("#picture-file", obstacles().file(name));
  };
  return [
    {
      what: "a page that is not secure gets no camera",
      code: "insecure-context",
      cause: async (page) => {
        await page.load(`${obstacles().open.origin}/?device=cpu`);
        await page.click("#use-camera");
      },
    },
    { what: "a damaged model is not used", code: "model-corrupt", cause: (page) => image(page, "damaged") },
    { what: "a model of which a file is missing is not used", code: "model-load", cause: (page) => image(page, "incomplete") },
    { what: "a model that is newer than the page is not used", code: "model-version", cause: (page) => image(page, "newer") },
    {
      what: "an engine that is not there is named",
      code: "engine-load",
      cause: async (page) => {
        await page.load(`${obstacles().engineless.origin}/?device=cpu`);
        await page.choose("#image-file", obstacles().file("blank.png"));
      },
    },
    {
      what: "a browser without what the engine needs is told so",
      code: "browser-unsupported",
      cause: async (page) => {
        await page.load();
        await page.run(() => void delete globalThis.OffscreenCanvas);
        await page.choose("#image-file", obstacles().file("blank.png"));
      },
    },
    {
      what: "WebGPU and nothing else is not had here",
      code: "webgpu-unavailable",
      cause: async (page) => {
        await page.load("?device=webgpu");
        await page.choose("#image-file", obstacles().file("blank.png"));
      },
    },
    {
      what: "an image that is none is not read",
      code: "image-unreadable",
      cause: async (page) => {
        await page.load();
        await page.choose("#image-file", obstacles().file("broken.png"));
      },
    },
    { what: "a picture of few pixels is refused", code: "picture-small", cause: picture("small.png") },
    { what: "a picture that is see-through is refused", code: "picture-empty", cause: picture("see-through.svg") },
    {
      what: "a picture with nothing to find it by is refused",
      code: "target-unusable",
      cause: async (page) => {
        await picture("blank.png")(page);
        await page.until(() => document.querySelector("#print-size").getBoundingClientRect().width > 0);
        await page.click('[value="postcard"]');
        await page.click('#print-size [value="camera"]');
      },
    },
    {
      what: "a camera that another program has is named",
      code: "camera-busy",
      cause: rejectedBy(() => {
        navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("Could not start video source", "NotReadableError"));
      }),
    },
    {
      what: "a camera that can do nothing of use is named",
      code: "camera-constraints",
      cause: rejectedBy(() => {
        navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("Invalid constraint", "OverconstrainedError"));
      }),
    },
    {
      what: "a defect of the page is called one",
      code: "internal",
      cause: rejectedBy(() => {
        HTMLMediaElement.prototype.play = () => Promise.reject(new TypeError("planted by a test"));
      }),
    },
  ];
}
