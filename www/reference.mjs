// The reference of the package, made of its declarations by TypeDoc: a page for each symbol, with a search. It is on the site in docs/api/.

import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Application, LogLevel } from "typedoc";

const www = (name) => fileURLToPath(new URL(name, import.meta.url));

/** The doors of the package, as pages import them, with their declarations in types/. */
const { exports } = JSON.parse(readFileSync(www("package.json"), "utf8"));
const typed = Object.entries(exports).filter(([, { types }]) => types);
export const DOORS = Object.fromEntries(typed.map(([name, { types }]) => [name.replace(".", "deepsft"), types.replace(/^\.\/types\/|\.d\.ts$/g, "")]));

/**
 * @param {string} out an empty folder
 * @throws where a comment or a declaration cannot be read
 */
export async function writeReference(out) {
  const application = await Application.bootstrap({
    name: "deepsft",
    entryPoints: Object.values(DOORS).map((file) => www(`types/${file}.d.ts`)),
    tsconfig: www("tsconfig.reference.json"),
    readme: "none",
    favicon: www("demo/icon.svg"),
    // What our classes have of three.js is in its own documents.
    excludeExternals: true,
    disableSources: true,
    navigationLinks: { "All pages": "../index.html", Examples: "../../examples/index.html", "The demo page": "../../index.html" },
    navigation: { includeCategories: false, includeGroups: false },
    logLevel: LogLevel.Error,
  });
  const project = await application.convert();
  if (!project) throw new Error("the package's declarations cannot be read");
  for (const door of project.children ?? []) {
    const [name] = Object.entries(DOORS).find(([, file]) => file === door.name || file === `${door.name}/index`) ?? [];
    if (name) door.name = name;
  }
  await application.generateDocs(project, out);
}
