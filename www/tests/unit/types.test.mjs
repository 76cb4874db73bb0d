import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const WWW = fileURLToPath(new URL("../../", import.meta.url));

test("the declarations in types/ are those of the sources (npm run types writes them)", () => {
  const fresh = mkdtempSync(join(tmpdir(), "deepsft-types-"));
  try {
    // Complaints about the sources are for `npm run check`; declarations are written all the same.
    const { error } = spawnSync(process.execPath, [
      join(WWW, "node_modules", "typescript-7", "bin", "tsc"),
      "-p",
      join(WWW, "tsconfig.types.json"),
      "--outDir",
      fresh,
    ]);
    assert.equal(error, undefined);
    const declarations = (folder) =>
      readdirSync(folder, { recursive: true }).filter((name) => name.endsWith(".d.ts")).sort();
    const names = declarations(fresh);
    assert.ok(names.includes("index.d.ts"));
    assert.deepEqual(declarations(join(WWW, "types")), names);
    for (const name of names)
      assert.equal(readFileSync(join(WWW, "types", name), "utf8"), readFileSync(join(fresh, name), "utf8"), name);
  } finally {
    rmSync(fresh, { recursive: true, force: true });
  }
});

test("resolvers that read no exports find the declarations of every module", () => {
  const project = mkdtempSync(join(tmpdir(), "deepsft-resolver-"));
  try {
    const { exports } = JSON.parse(readFileSync(join(WWW, "package.json"), "utf8"));
    const modules = Object.keys(exports).filter((name) => exports[name].types);
    mkdirSync(join(project, "node_modules"));
    symlinkSync(WWW, join(project, "node_modules", "deepsft"));
    writeFileSync(join(project, "main.ts"), modules.map((name) => `export * from "deepsft${name.slice(1)}";`).join("\n"));
    const options = ["--moduleResolution", "node10", "--ignoreDeprecations", "6.0", "--module", "esnext", "--target", "es2022"];
    const tsc = [join(WWW, "node_modules", "typescript", "bin", "tsc"), "--noEmit", "--skipLibCheck", ...options];
    const { status, stdout } = spawnSync(process.execPath, [...tsc, "main.ts"], { cwd: project, encoding: "utf8" });
    assert.equal(status, 0, stdout);
    assert.equal(modules.length, 6);
  } finally {
    rmSync(project, { recursive: true, force: true });
  }
});
