// What axe-core finds on a page.

import { readFile } from "node:fs/promises";
import { join } from "node:path";

import { WWW } from "../../serve.mjs";

/** Serious and critical violations, each with the elements it is about. @param {import("playwright-core").Page} page */
export async function violations(page) {
  await page.evaluate(await readFile(join(WWW, "node_modules", "axe-core", "axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  return violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ target, failureSummary }) => `${target} ${failureSummary}`).join("; ")}`);
}
