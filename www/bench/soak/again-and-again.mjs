// What is started and stopped, added and removed, again and again: the page's camera, trackings, targets, single images.

import { CYCLES, prepare } from "../../tests/support/cycles.mjs";
import { FollowedPage } from "../../tests/support/followed-page.mjs";
import { BLANK } from "../../tests/support/page.mjs";

/** Rounds after which nothing may grow any more, as a fraction of all. */
const SETTLED = 0.2;
const SAMPLES = 10;

/** The page's camera is started and stopped so often. */
const CAMERA_STARTS = 50;

/** What is done with the package, and how often. */
const TIMES = { trackings: 50, targets: 200, images: 500 };

/**
 * @param {string} film
 * @param {import("./report.mjs").Report} report
 */
export async function againAndAgain(film, report) {
  await cameraStarts(film, report);
  const page = await FollowedPage.open({ camera: film, device: "cpu", path: BLANK });
  try {
    await prepare(page.page);
    for (const [name, times] of Object.entries(TIMES)) await cycle(report, { name, times, page, once: () => page.page.evaluate(CYCLES[name]) });
    report.expect(page.problems.length === 0, `errors on the page: ${page.problems.join("; ")}`);
  } finally {
    await page.close();
  }
}

async function cameraStarts(film, report) {
  const page = await FollowedPage.open({ camera: film, device: "cpu" });
  try {
    const once = async () => {
      await page.start();
      await page.page.click("#back");
    };
    await cycle(report, { name: "camera-starts", times: CAMERA_STARTS, page, once });
    report.expect(page.problems.length === 0, `errors on the page: ${page.problems.join("; ")}`);
  } finally {
    await page.close();
  }
}

/** Does something again and again, measures now and then, and judges. */
async function cycle(report, { name, times, page, once }) {
  const part = report.part(name, "times");
  const every = times / SAMPLES;
  for (let time = 1; time <= times; time++) {
    await once();
    if (time % every === 0) part.add(await page.footprint(), time);
  }
  report.judge(`${name}, ${times} times`, part, ({ at }) => at >= SETTLED * times);
}
