//! `wasm-pack.toml`, the build manifest of the browser package, and its agreement with the files that
//! state the same facts: `Cargo.lock`, `.cargo/config.toml` and `www/package.json`.

use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;
use std::{fs, path::Path};

/// Name of the manifest in the workspace's root.
pub const FILE_NAME: &str = "wasm-pack.toml";

/// The one compilation target of browser builds.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// The whole manifest. Unknown keys are refused: a misspelt one would silently do nothing.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Manifest {
    pub package: Package,
    pub tools: Tools,
    pub rustc: Flags,
    pub wasm_opt: Flags,
    pub budget: Budget,
    pub browser_tests: BrowserTests,
}

/// What is built, and where it goes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Package {
    #[serde(rename = "crate")]
    pub crate_name: String,
    /// Relative to the workspace's root.
    pub out_dir: String,
    /// Cargo's `--profile`.
    pub profile: String,
}

/// Exact versions of the tools.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Tools {
    pub binaryen: String,
    /// Least major version of Node.js.
    pub node_at_least: u32,
}

/// Command line flags of one tool.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flags {
    pub flags: Vec<String>,
}

/// Download sizes, gzipped, in units of 10^6 bytes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Budget {
    pub gzip_mb_aim: f64,
    pub gzip_mb_limit: f64,
}

/// How the browser tests start Chromium.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct BrowserTests {
    pub chromium_flags: Vec<String>,
}

impl Manifest {
    /// Reads the manifest in `root` and compares it with the files that state the same facts.
    ///
    /// # Errors
    /// When the manifest cannot be read or disagrees with another file; the message names both.
    pub fn load(root: &Path) -> Result<Self> {
        let manifest: Self = toml::from_str(&read(root, FILE_NAME)?).with_context(|| format!("reading {FILE_NAME}"))?;
        let lock = read(root, "Cargo.lock")?;
        let [library, program] = ["wasm-bindgen", "wasm-bindgen-cli-support"].map(|name| locked_version(&lock, name));
        let (library, program) = (library?, program?);
        ensure!(
            library == program,
            "Cargo.lock has wasm-bindgen {library} and wasm-bindgen-cli-support {program}; `cargo update` both to one version"
        );
        let configured = wasm_rustflags(&read(root, ".cargo/config.toml")?)?;
        agree("rustc flags", &manifest.rustc.flags, &configured, ".cargo/config.toml")?;
        let npm = npm_version(&read(root, "www/package.json")?, "binaryen")?;
        agree("binaryen", &manifest.tools.binaryen, &npm, "www/package.json")?;
        ensure!(
            manifest.budget.gzip_mb_aim <= manifest.budget.gzip_mb_limit,
            "{FILE_NAME}: the size aim is above the limit"
        );
        Ok(manifest)
    }
}

fn read(root: &Path, file: &str) -> Result<String> {
    fs::read_to_string(root.join(file)).with_context(|| format!("reading {file}"))
}

fn agree<T: PartialEq + std::fmt::Debug>(what: &str, ours: &T, theirs: &T, file: &str) -> Result<()> {
    ensure!(
        ours == theirs,
        "{what}: {FILE_NAME} says {ours:?}, {file} says {theirs:?}; make them equal"
    );
    Ok(())
}

/// The version of `package` in the text of a `Cargo.lock`; an error unless there is exactly one.
fn locked_version(lock: &str, package: &str) -> Result<String> {
    #[derive(Deserialize)]
    struct Lock {
        package: Vec<Locked>,
    }
    #[derive(Deserialize)]
    struct Locked {
        name: String,
        version: String,
    }
    let lock: Lock = toml::from_str(lock).context("reading Cargo.lock")?;
    let mut versions: Vec<String> = lock
        .package
        .into_iter()
        .filter(|p| p.name == package)
        .map(|p| p.version)
        .collect();
    match (versions.pop(), versions.is_empty()) {
        (Some(version), true) => Ok(version),
        (None, _) => bail!("Cargo.lock has no package {package}"),
        (Some(version), false) => bail!("Cargo.lock has {package} {version} and {}", versions.join(", ")),
    }
}

/// The flags of `[target.wasm32-unknown-unknown]` in the text of a cargo configuration.
fn wasm_rustflags(config: &str) -> Result<Vec<String>> {
    let config: toml::Table = toml::from_str(config).context("reading .cargo/config.toml")?;
    let flags = config
        .get("target")
        .and_then(|targets| targets.get(TARGET))
        .and_then(|target| target.get("rustflags"))
        .and_then(toml::Value::as_array)
        .with_context(|| format!(".cargo/config.toml has no list target.{}.rustflags", TARGET))?;
    Ok(flags
        .iter()
        .filter_map(toml::Value::as_str)
        .map(str::to_owned)
        .collect())
}

/// The version that the text of a `package.json` asks for `package` with, exactly as written.
fn npm_version(package_json: &str, package: &str) -> Result<String> {
    let json: serde_json::Value = serde_json::from_str(package_json).context("reading www/package.json")?;
    let version = json["devDependencies"][package].as_str();
    version
        .map(str::to_owned)
        .with_context(|| format!("www/package.json has no devDependency {package}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manifest_agrees_with_the_files_that_state_the_same_facts() {
        Manifest::load(&crate::workspace_root().unwrap()).unwrap();
    }

    #[test]
    fn a_misspelt_key_is_refused_by_name() {
        let text = read(&crate::workspace_root().unwrap(), FILE_NAME)
            .unwrap()
            .replace("gzip-mb-aim", "gzip-mb-goal");
        let error = toml::from_str::<Manifest>(&text).unwrap_err().to_string();
        assert!(error.contains("gzip-mb-goal"), "{error}");
    }

    #[test]
    fn a_library_locked_in_two_versions_is_refused() {
        let entry = |version: &str| format!("[[package]]\nname = \"wasm-bindgen\"\nversion = \"{version}\"\n");
        assert_eq!(locked_version(&entry("1.2.3"), "wasm-bindgen").unwrap(), "1.2.3");
        let both = entry("1.2.3") + &entry("1.2.4");
        assert!(
            locked_version(&both, "wasm-bindgen")
                .unwrap_err()
                .to_string()
                .contains("1.2.3")
        );
        assert!(locked_version(&both, "js-sys").is_err());
    }

    #[test]
    fn a_disagreement_names_both_files_and_both_values() {
        let error = agree("binaryen", &"1.0.0", &"2.0.0", "www/package.json")
            .unwrap_err()
            .to_string();
        for part in ["binaryen", FILE_NAME, "1.0.0", "www/package.json", "2.0.0"] {
            assert!(error.contains(part), "{error}");
        }
    }
}
