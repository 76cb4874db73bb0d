//! The browser package: cargo, wasm-bindgen and wasm-opt, as `wasm-pack.toml` says, within its budget.

use crate::{third_party, tools};
use anyhow::{Context, Result, ensure};
use flate2::{Compression, write::GzEncoder};
use serde::Deserialize;
use std::{fs, io::Write, path::Path, process::Command};
use wasm_bindgen_cli_support::Bindgen;

/// Name of the build manifest in the workspace's root.
pub const MANIFEST: &str = "wasm-pack.toml";

/// The one compilation target of browser builds.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// Bytes in a megabyte of a download.
const MB: f64 = 1e6;

/// The build manifest. Unknown keys are refused: a misspelt one would silently do nothing.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Manifest {
    pub package: Package,
    wasm_opt: WasmOpt,
    budget: Budget,
}

/// What is built, and where it goes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Package {
    #[serde(rename = "crate")]
    crate_name: String,
    /// Relative to the workspace's root.
    pub out_dir: String,
    /// Cargo's `--profile`.
    profile: String,
}

/// How the module is optimised.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WasmOpt {
    flags: Vec<String>,
}

/// Download sizes, gzipped, in units of 10^6 bytes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Budget {
    gzip_mb_aim: f64,
    gzip_mb_limit: f64,
}

impl Manifest {
    /// Reads the manifest in `root`.
    pub fn load(root: &Path) -> Result<Self> {
        let text = fs::read_to_string(root.join(MANIFEST)).with_context(|| format!("reading {MANIFEST}"))?;
        toml::from_str(&text).with_context(|| format!("reading {MANIFEST}"))
    }
}

impl Package {
    /// What a page downloads of it: the module and its JavaScript.
    pub fn files(&self) -> [String; 2] {
        let name = self.crate_name.replace('-', "_");
        [format!("{name}_bg.wasm"), format!("{name}.js")]
    }
}

/// Builds the package into the manifest's `out-dir`, with the licences of what it is compiled from, and `www/dist` of it. After cargo,
/// nothing is bound or optimised when neither the compiled module nor the manifest has changed.
pub fn build(root: &Path) -> Result<()> {
    let Manifest {
        package,
        wasm_opt,
        budget,
    } = Manifest::load(root)?;
    let target_folder = tools::target_folder(root)?;
    tools::ensure_node_packages(root)?;
    let mut cargo = tools::cargo(root);
    cargo.args(["build", "--target", TARGET, "--profile", &package.profile]);
    tools::run(cargo.args(["--package", &package.crate_name]))?;
    let name = package.crate_name.replace('-', "_");
    let compiled = target_folder
        .join(TARGET)
        .join(&package.profile)
        .join(format!("{name}.wasm"));

    let out = root.join(&package.out_dir);
    let [module, script] = package.files();
    let stamp_file = target_folder.join("xtask").join("web.stamp");
    let stamp = [read(&compiled)?, read(&root.join(MANIFEST))?].concat();
    let is_current = fs::read(&stamp_file).is_ok_and(|old| old == stamp);
    let files = [&module, &script, &format!("{name}.d.ts")];
    if !(is_current && files.iter().all(|file| out.join(file).is_file())) {
        // Built aside and moved at the end: `out` never holds half a package.
        let aside = out.with_extension("tmp");
        tools::empty(&aside)?;
        Bindgen::new()
            .input_path(&compiled)
            .typescript(true)
            .omit_default_module_path(true)
            .web(true)
            .and_then(|bindgen| bindgen.generate(&aside))
            .with_context(|| format!("wasm-bindgen on {}", compiled.display()))?;
        optimise(root, &wasm_opt.flags, &aside.join(&module))?;
        tools::empty(&out)?;
        let moved = fs::remove_dir(&out).and_then(|()| fs::rename(&aside, &out));
        moved.with_context(|| format!("moving the package to {}", out.display()))?;
        write(&stamp_file, &stamp)?;
    }
    let notices = third_party::notices(root, &package.crate_name, Some(TARGET))?;
    write(&out.join(third_party::FILE_NAME), notices.as_bytes())?;
    tools::run(Command::new("node").arg(root.join("www/dist.mjs")))?;

    let mut total = 0.0;
    for file in [module, script] {
        let bytes = read(&out.join(&file))?;
        let zipped = gzip_length(&bytes)? as f64 / MB;
        let stored = bytes.len() as f64 / MB;
        println!("{}/{file}: {stored:.2} MB, {zipped:.2} MB gzipped", package.out_dir);
        total += zipped;
    }
    keep_budget(total, &budget)
}

/// Runs wasm-opt of the npm package binaryen on `module`, in place.
fn optimise(root: &Path, flags: &[String], module: &Path) -> Result<()> {
    let script = root.join("www/node_modules/binaryen/bin/wasm-opt");
    let optimised = module.with_extension("opt.wasm");
    // The program is WebAssembly itself, run by Node.js, and recurses deeply over a large module.
    let mut command = Command::new("node");
    command.arg("--stack-size=8192").arg(script).args(flags);
    command.arg(module).arg("-o").arg(&optimised);
    tools::run(&mut command).context("wasm-opt of the npm package binaryen")?;
    fs::rename(&optimised, module).with_context(|| format!("replacing {}", module.display()))
}

/// The content of a file; an error names it.
pub fn read(file: &Path) -> Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("reading {}", file.display()))
}

/// Writes a file, with its folder; an error names it.
pub fn write(file: &Path, content: &[u8]) -> Result<()> {
    let writing = || format!("writing {}", file.display());
    fs::create_dir_all(file.parent().unwrap_or(file)).with_context(writing)?;
    fs::write(file, content).with_context(writing)
}

/// The length of `bytes` compressed as well as gzip can.
pub fn gzip_length(bytes: &[u8]) -> Result<usize> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len())
}

/// Compares the size in MB with the budget.
fn keep_budget(zipped_mb: f64, budget: &Budget) -> Result<()> {
    let Budget {
        gzip_mb_aim: aim,
        gzip_mb_limit: limit,
    } = budget;
    ensure!(
        zipped_mb <= *limit,
        "the browser package is {zipped_mb:.2} MB gzipped, over its limit of {limit} MB ({MANIFEST})"
    );
    let verdict = if zipped_mb <= *aim { "within" } else { "over" };
    println!("{zipped_mb:.2} MB gzipped in all, {verdict} the aim of {aim} MB (limit {limit} MB)");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_over_the_limit_is_refused_and_one_over_the_aim_is_not() {
        let budget = Budget {
            gzip_mb_aim: 3.0,
            gzip_mb_limit: 4.0,
        };
        assert!(keep_budget(2.9, &budget).is_ok());
        assert!(keep_budget(3.5, &budget).is_ok());
        assert!(keep_budget(4.01, &budget).unwrap_err().to_string().contains("4.01 MB"));
    }

    #[test]
    fn the_manifest_is_read_and_a_misspelt_key_is_refused_by_name() {
        let root = crate::workspace_root().unwrap();
        Manifest::load(&root).unwrap();
        let text = fs::read_to_string(root.join(MANIFEST)).unwrap();
        let error = toml::from_str::<Manifest>(&text.replace("gzip-mb-aim", "gzip-mb-goal")).unwrap_err();
        assert!(error.to_string().contains("gzip-mb-goal"), "{error}");
    }
}
