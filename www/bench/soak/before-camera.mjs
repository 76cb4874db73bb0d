// The demo page before a camera, for thousands of frames, and then in trouble.

import { FollowedPage } from "../../tests/support/followed-page.mjs";

/** What is there after so many frames is what must not grow. */
const SETTLED_FRAMES = 500;
const HIDDEN_MS = 20_000;
const LOSSES = 30;
/** By so much the page's clock is put forward before a loss: a GPU that is lost sooner after its start counts as broken, milliseconds. */
const BETWEEN_LOSSES_MS = 65_000;
const TURNS = 10;
const REVOCATIONS = 30;
/** After so many the code that restarts all is compiled; each has a tracker of its own, and one holds a little more than another. */
const SETTLED_RESTARTS = 10;
const FIRST_TRACKERS = 3;

/**
 * @param {{ film: string, device: "cpu" | "webgpu", frames: number, every: number }} options
 * @param {import("./report.mjs").Report} report
 */
export async function beforeCamera({ film, device, frames, every }, report) {
  const page = await FollowedPage.open({ camera: film, device });
  try {
    await page.start();
    const part = report.part(`camera-${device}`, "frames");
    const sample = async (/** @type {string} */ event) => part.add(await page.footprint(), (await page.counts()).frames, event);
    for (let next = every; next <= frames; next += every) {
      await page.until(({ frames }) => frames >= next);
      await sample("");
    }
    const { found, answers } = await page.counts();
    console.log(`\n${device}: found in ${((100 * found) / frames).toFixed(0)} % of the frames, ${answers} answers of the network`);
    report.judge(`${part.name}, ${frames} frames`, part, ({ at }) => at >= SETTLED_FRAMES);
    for (const { name, times, happen, settled = 0, firsts } of device === "cpu" ? onCpu(page) : [gpuLosses(page)]) {
      const began = part.samples.length;
      for (let time = 1; time <= times; time++) {
        const said = await happen();
        const happened = performance.now();
        await page.followsOn();
        console.log(`${name}, time ${time} of ${times}: ${said}followed on after ${((performance.now() - happened) / 1000).toFixed(1)} s`);
        await sample(name);
      }
      // The first time may open what is kept: a card that says what is in the way, code that is compiled.
      const counted = new Set(part.samples.slice(began + settled));
      const of = settled > 0 ? ` but the first ${settled}` : "";
      report.judge(`${part.name}, ${name} ${times} times${of}`, part, (sample) => counted.has(sample), { firsts });
    }
    report.expect(page.problems.length === 0, `errors on the page: ${page.problems.join("; ")}`);
  } finally {
    await page.close();
  }
}

/** @param {FollowedPage} page */
function onCpu(page) {
  return [
    {
      name: "hidden tab",
      times: 3,
      happen: async () => `${await page.hide(HIDDEN_MS)} frames in ${HIDDEN_MS / 1000} s, `,
    },
    {
      name: "rotation",
      times: TURNS,
      happen: async () => {
        await page.turn(true);
        const { upright } = await page.counts();
        await page.until((now) => now.upright >= upright + 10);
        await page.turn(false);
        return "";
      },
    },
    {
      name: "revoked camera",
      times: REVOCATIONS,
      settled: SETTLED_RESTARTS,
      firsts: FIRST_TRACKERS,
      happen: async () => {
        await page.permit("denied");
        const code = await page.message();
        await page.permit("granted");
        await page.page.click("#message-remedies button");
        return `${code}, `;
      },
    },
  ];
}

/** @param {FollowedPage} page */
function gpuLosses(page) {
  return {
    name: "device.destroy()",
    times: LOSSES,
    settled: SETTLED_RESTARTS,
    happen: async () => {
      await page.page.evaluate((ms) => {
        const { now } = Date;
        globalThis.ahead ??= ((Date.now = () => now() + globalThis.ahead), 0);
        globalThis.ahead += ms;
      }, BETWEEN_LOSSES_MS);
      await page.loseGpu();
      return "";
    },
  };
}
