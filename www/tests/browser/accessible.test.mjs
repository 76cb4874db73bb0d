// What axe-core finds on each screen, in light and dark; what a keyboard reaches; what a screen reader is told.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { violations } from "../support/axe.mjs";
import { DESKTOP, PHONE, SLOW_MS, launch, messageOf, openDemo } from "../support/browser.mjs";
import { MODEL } from "../support/native.mjs";
import { posterScan } from "../support/scans.mjs";

/** Measures are read out this often at most, milliseconds. */
const READ_MS = 4000;

let browser;
before(async () => (browser = await launch({ webgpu: false })));
after(() => browser?.close());

const SCREENS = {
  start: (page) => page.waitForSelector("#choose-picture"),
  running: async (page) => {
    await page.click("#use-clip");
    await page.waitForSelector("#measures:not([hidden])");
    await page.click('#overlays [value="object"]');
    if (!(await page.isVisible("#hud"))) await page.click("#hud-toggle");
  },
  own: async (page) => {
    await page.setInputFiles("#picture-file", join(MODEL, "template", "texture.png"));
    await page.waitForSelector("#print-size");
    await page.waitForSelector("#flat");
  },
  scan: async (page) => {
    await page.setInputFiles("#scan-file", await posterScan());
    await page.waitForSelector('#scan[data-state="sheet"]');
  },
  error: async (page) => {
    await page.click("#use-camera");
    await messageOf(page);
  },
};

/** Pages of the site that are only read. */
const READ = { documentation: "/docs/draw.html", examples: "/examples/index.html" };

/** Judges what a page shows in light and dark. */
async function assertAccessible(demo, name) {
  for (const colorScheme of ["light", "dark"]) {
    await demo.page.emulateMedia({ colorScheme });
    await demo.screenshot(`accessible-${name}-${colorScheme}`);
    assert.deepEqual(await violations(demo.page), [], colorScheme);
  }
}

for (const [deviceName, device] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
  for (const [name, path] of Object.entries(READ)) {
    test(`${name}, ${deviceName}, light and dark: nothing serious`, { timeout: SLOW_MS }, async () => {
      const demo = await openDemo(browser, { device, path });
      await assertAccessible(demo, `${name}-${deviceName}`);
      await demo.page.close();
    });
  }
  for (const [screen, go] of Object.entries(SCREENS)) {
    test(`${screen}, ${deviceName}, light and dark: nothing serious`, { timeout: SLOW_MS }, async () => {
      const demo = await openDemo(browser, { device: { ...device, reducedMotion: "reduce" }, query: "?device=cpu" });
      await go(demo.page);
      await assertAccessible(demo, `${screen}-${deviceName}`);
      await demo.finish();
    });
  }
}

test("a keyboard reaches every control of the running page, and each shows that it has the focus", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu" });
  const { page } = demo;
  await page.focus("#use-clip");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#measures:not([hidden])");
  const wanted = await page.evaluate(() => [...document.querySelectorAll("#live :is(button, :checked:not(option))")].filter((control) => control.checkVisibility() && control.tabIndex === 0).length);
  const seen = await page.evaluate(() => (globalThis.seen = new Set()).size);
  assert.equal(seen, 0);
  for (let i = 0; i < wanted + 4; i++) {
    await page.keyboard.press("Tab");
    const outline = await page.evaluate(() => {
      if (!document.activeElement.matches("#live :is(button, :checked)")) return null;
      globalThis.seen.add(document.activeElement);
      return getComputedStyle(document.activeElement).outlineWidth;
    });
    if (outline !== null) assert.equal(outline, "2px");
  }
  assert.ok(wanted >= 6, `${wanted} controls`);
  assert.equal(await page.evaluate(() => globalThis.seen.size), wanted);
  await demo.finish();
});

test("a screen reader is told a few sentences while the clip runs, not every figure", { timeout: SLOW_MS }, async () => {
  const demo = await openDemo(browser, { query: "?device=cpu" });
  const { page } = demo;
  await page.click("#use-clip");
  await page.waitForSelector("#measures:not([hidden])");
  const told = await page.evaluate(async () => {
    const told = [];
    let figures = 0;
    const live = [...document.querySelectorAll("#live :is([role=status], [role=alert], [aria-live])")];
    const watch = (node, take) => new MutationObserver(take).observe(node, { childList: true, characterData: true, subtree: true });
    for (const node of live) watch(node, () => told.push(node.textContent));
    watch(document.querySelector("#state-text"), () => figures++);
    // For eight seconds at least: a busy machine shows fewer frames in them.
    const began = performance.now();
    while (figures < 8 || performance.now() - began < 8000) await new Promise((resolve) => setTimeout(resolve, 100));
    return { told, figures, ms: performance.now() - began };
  });
  // A busy machine loses the sheet and finds it again, and says so: each state once, and no percentages.
  const states = told.told.filter((words) => !words.endsWith("away"));
  const all = `${told.figures} changes for the eye; told: ${JSON.stringify(told.told)}`;
  assert.ok(states.every((words, k) => !/\d/.test(words) && words !== states[k - 1]), all);
  assert.ok(told.told.length - states.length <= 1 + told.ms / READ_MS, all);
  assert.match(await page.textContent("#measures-said"), /away$/);
  await page.waitForFunction(() => document.querySelector("#state-said").textContent === "Found");
  await demo.finish();
});

test("who wants less motion gets none that only decorates", { timeout: SLOW_MS }, async () => {
  const moving = async (reducedMotion) => {
    const demo = await openDemo(browser, { device: { ...PHONE, reducedMotion } });
    if (reducedMotion === "reduce") assert.ok(await demo.page.evaluate(() => document.querySelector("#hero").paused), "the film stands still");
    else await demo.page.waitForFunction(() => document.querySelector("#hero").currentTime > 0);
    const found = await demo.page.evaluate(() => {
      document.querySelector("#live").hidden = false;
      document.querySelector("#loading-bar").removeAttribute("value");
      const styles = [...document.querySelectorAll("body *")].map((element) => getComputedStyle(element));
      return styles.filter(({ animationName, transitionDuration }) => animationName !== "none" || transitionDuration !== "0s").length;
    });
    await demo.finish();
    return found;
  };
  assert.equal(await moving("reduce"), 0);
  assert.ok((await moving("no-preference")) > 3);
});
