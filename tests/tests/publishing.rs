//! What is published is complete: descriptions, licence texts, pages, and versions that agree.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use std::{collections::BTreeSet, fs, path::Path, process::Command};

/// The crates that stay here. `deepsft-web` is published compiled, in the npm package.
const UNPUBLISHED: &[&str] = &[
    "deepsft-baselines",
    "deepsft-fuzz",
    "deepsft-lab",
    "deepsft-tests",
    "deepsft-web",
    "xtask",
];

/// Categories as the registry spells them. It takes no other, and says so only when a crate is uploaded.
const CATEGORIES: &[&str] = &[
    "algorithms",
    "command-line-utilities",
    "computer-vision",
    "encoding",
    "hardware-support",
    "mathematics",
    "rendering",
    "science",
    "simulation",
    "wasm",
];

/// What the registry takes.
const MAX_KEYWORDS: usize = 5;
const LONGEST_KEYWORD: usize = 20;

/// Bytes of all files of a crate: three times the largest, and far less than images or weights.
const MAX_BYTES: u64 = 1_500_000;

const LICENCES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

fn cargo(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    let output = command.current_dir(deepsft_tests::root()).args(arguments).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The packages of the workspace as `cargo metadata` describes them.
fn packages() -> Vec<Value> {
    let metadata = cargo(&["metadata", "--format-version", "1", "--no-deps", "--offline"]);
    let metadata: Value = serde_json::from_str(&metadata).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// Those that are published.
fn published() -> Vec<Value> {
    packages().into_iter().filter(|p| p["publish"].is_null()).collect()
}

fn text<'a>(of: &'a Value, field: &str) -> &'a str {
    of[field].as_str().unwrap_or_default()
}

fn list<'a>(of: &'a Value, field: &str) -> Vec<&'a str> {
    of[field].as_array().unwrap().iter().filter_map(Value::as_str).collect()
}

fn folder(package: &Value) -> &Path {
    Path::new(text(package, "manifest_path")).parent().unwrap()
}

#[test]
fn all_crates_are_published_but_those_that_only_we_use() {
    let packages = packages();
    let kept = packages.iter().filter(|p| !p["publish"].is_null());
    let kept: BTreeSet<&str> = kept.map(|p| text(p, "name")).collect();
    assert_eq!(kept, UNPUBLISHED.iter().copied().collect());
}

#[test]
fn every_published_crate_says_what_it_is() {
    for package in &published() {
        let name = text(package, "name");
        assert!(text(package, "description").len() > 30, "{name}: no description");
        assert!(
            text(package, "license").contains("MIT OR Apache-2.0"),
            "{name}: no licence"
        );
        assert!(!text(package, "repository").is_empty(), "{name}: no repository");
        assert!(!text(package, "rust_version").is_empty(), "{name}: no Rust version");
        let (keywords, categories) = (list(package, "keywords"), list(package, "categories"));
        assert!((1..=MAX_KEYWORDS).contains(&keywords.len()), "{name}: {keywords:?}");
        let fits = |word: &&str| word.len() <= LONGEST_KEYWORD && word.starts_with(|c: char| c.is_ascii_alphabetic());
        assert!(keywords.iter().all(fits), "{name}: {keywords:?}");
        assert!(!categories.is_empty(), "{name}: no category");
        for category in categories {
            assert!(CATEGORIES.contains(&category), "{name}: {category}");
        }
        let targets = list(&package["metadata"]["docs"]["rs"], "targets");
        assert_eq!(
            targets,
            ["x86_64-unknown-linux-gnu"],
            "{name}: docs.rs builds for five targets"
        );
        let readme = fs::read_to_string(folder(package).join(text(package, "readme"))).unwrap();
        assert_eq!(
            readme.lines().next(),
            Some(format!("# {name}").as_str()),
            "{name}: README"
        );
    }
}

#[test]
fn every_published_crate_carries_its_licences_and_no_ballast() {
    let packages = published();
    assert!(packages.len() > 5, "the workspace was not read");
    for package in &packages {
        let name = text(package, "name");
        let listed = cargo(&["package", "--list", "--allow-dirty", "--offline", "--package", name]);
        let listed = listed.replace('\\', "/");
        let files: BTreeSet<&str> = listed.lines().collect();
        for file in ["Cargo.toml", "README.md", "src/lib.rs"].iter().chain(&LICENCES) {
            assert!(files.contains(file), "{name} lacks {file}");
        }
        // What cargo itself adds is not in the folder.
        let sizes = files
            .iter()
            .filter_map(|file| fs::metadata(folder(package).join(file)).ok());
        let bytes: u64 = sizes.map(|file| file.len()).sum();
        assert!(bytes < MAX_BYTES, "{name}: {bytes} bytes");
    }
}

/// Links in git. Windows checks them out as files that hold a path.
#[test]
#[cfg(unix)]
fn the_licences_of_the_crates_are_those_of_the_root() {
    for package in &published() {
        for licence in LICENCES {
            let ours = fs::read(folder(package).join(licence)).unwrap();
            let root = fs::read(deepsft_tests::root().join(licence)).unwrap();
            assert!(ours == root, "{}: {licence}", text(package, "name"));
        }
    }
}

#[test]
fn crates_of_ours_are_asked_for_in_the_version_of_the_workspace() {
    let mut seen = 0;
    for package in &published() {
        let name = text(package, "name");
        let asked = format!("^{}", text(package, "version"));
        for dependency in package["dependencies"].as_array().unwrap() {
            if dependency["path"].is_null() {
                continue;
            }
            seen += 1;
            let (used, version) = (text(dependency, "name"), text(dependency, "req"));
            // Cargo leaves out a dependency of tests alone that has no version: that is how two crates test against each other.
            let left_out = text(dependency, "kind") == "dev" && version == "*";
            assert!(version == asked || left_out, "{name}: {used} {version}");
            assert!(!UNPUBLISHED.contains(&used) || left_out, "{name} needs {used}");
        }
    }
    assert!(seen > 15, "the dependencies were not read");
}

#[test]
fn the_npm_package_has_the_version_and_the_licences_of_the_workspace() {
    let www = deepsft_tests::root().join("www");
    let json = fs::read_to_string(www.join("package.json")).unwrap();
    let package: Value = serde_json::from_str(&json).unwrap();
    let packages = packages();
    let web = packages.iter().find(|p| text(p, "name") == "deepsft-web").unwrap();
    for field in ["version", "license"] {
        assert_eq!(text(&package, field), text(web, field), "{field}");
    }
    let files = list(&package, "files");
    // Of pkg/ all but the module, which is in dist/.
    let packed = ["src", "types", "dist", "pkg/*.js", "pkg/*.ts", "pkg/*.txt"];
    for file in packed.iter().chain(&LICENCES) {
        assert!(files.contains(file), "package.json lists no {file}");
    }
    // Copies, because npm leaves links out.
    for licence in LICENCES {
        let ours = www.join(licence);
        assert!(fs::symlink_metadata(&ours).unwrap().is_file(), "{licence} is a link");
        let root = fs::read(deepsft_tests::root().join(licence)).unwrap();
        assert!(fs::read(ours).unwrap() == root, "{licence}");
    }
}
