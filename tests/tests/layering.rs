//! The arrows between the crates, and what may never reach a browser.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Our crates and the crates of ours each may use. `crates/README.md` draws the same picture.
const ARROWS: &[(&str, &[&str])] = &[
    ("deepsft-geometry", &[]),
    ("deepsft-formats", &["deepsft-geometry"]),
    ("deepsft", &["deepsft-formats", "deepsft-geometry"]),
    ("deepsft-synth", &["deepsft-formats", "deepsft-geometry"]),
    (
        "deepsft-train",
        &["deepsft", "deepsft-synth", "deepsft-formats", "deepsft-geometry"],
    ),
    (
        "deepsft-cli",
        &[
            "deepsft",
            "deepsft-synth",
            "deepsft-train",
            "deepsft-formats",
            "deepsft-geometry",
        ],
    ),
    ("deepsft-web", &["deepsft", "deepsft-formats", "deepsft-geometry"]),
    ("xtask", &[]),
];

/// Crates that must not be in the tree of the browser build.
const NEVER_IN_THE_BROWSER: &[&str] = &[
    "deepsft-train",
    "deepsft-synth",
    "deepsft-cli",
    "clap",
    "anyhow",
    "gltf",
    "rayon",
    "tar",
    "tempfile",
    "indicatif",
    "burn-autodiff",
    "burn-optim",
];

/// The packages of the workspace as `cargo metadata` describes them.
fn packages() -> Vec<Value> {
    let output = std::process::Command::new(env!("CARGO"))
        .current_dir(deepsft_tests::root())
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

fn text<'a>(of: &'a Value, field: &str) -> &'a str {
    of[field].as_str().unwrap_or_default()
}

fn dependencies(package: &Value) -> &[Value] {
    package["dependencies"].as_array().unwrap()
}

#[test]
fn no_crate_uses_another_than_the_arrows_allow() {
    let packages = packages();
    let ours: BTreeSet<&str> = packages.iter().map(|p| text(p, "name")).collect();
    assert!(ours.contains("deepsft"), "the workspace was not read");
    let allowed: BTreeMap<&str, &[&str]> = ARROWS.iter().copied().collect();
    for package in packages.iter().filter(|p| text(p, "name") != "deepsft-tests") {
        let name = text(package, "name");
        let arrows = allowed
            .get(name)
            .unwrap_or_else(|| panic!("{name} is not in the map of crates"));
        // The kind of a normal dependency is null.
        for dependency in dependencies(package).iter().filter(|d| d["kind"].is_null()) {
            let used = text(dependency, "name");
            assert!(
                !ours.contains(used) || arrows.contains(&used),
                "{name} must not use {used}"
            );
        }
    }
}

#[test]
fn every_dependency_is_pinned_exactly_and_none_comes_from_git() {
    for package in &packages() {
        for dependency in dependencies(package).iter().filter(|d| d["path"].is_null()) {
            let (name, used) = (text(package, "name"), text(dependency, "name"));
            let version = text(dependency, "req");
            assert!(
                version.starts_with('='),
                "{used} of {name} is not pinned exactly: {version}"
            );
            assert!(
                !text(dependency, "source").starts_with("git"),
                "{used} of {name} comes from git"
            );
        }
    }
}

#[test]
fn the_browser_tree_holds_no_training_and_no_tools_of_the_terminal() {
    let output = std::process::Command::new(env!("CARGO"))
        .current_dir(deepsft_tests::root())
        // Not offline: what only the browser build uses may not have been fetched yet.
        .args([
            "tree",
            "--locked",
            "--package",
            "deepsft-web",
            "--target",
            "wasm32-unknown-unknown",
        ])
        .args(["--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tree = String::from_utf8(output.stdout).unwrap();
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(
        names.contains("deepsft") && names.contains("burn"),
        "the tree was not read"
    );
    for name in NEVER_IN_THE_BROWSER {
        assert!(!names.contains(name), "{name} reaches the browser");
    }
}

/// Where `cfg(target_family = "wasm")` may stand.
const WASM_PLACES: &[&str] = &["crates/deepsft/src/device.rs", "crates/deepsft-web/"];

#[test]
fn only_the_start_of_devices_and_the_bindings_know_that_there_is_wasm() {
    let root = deepsft_tests::root();
    let mut folders = vec![root.join("crates")];
    let mut seen = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let relative = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
                let text = std::fs::read_to_string(&path).unwrap();
                let knows = text.contains("target_family = \"wasm\"") || text.contains("target_arch = \"wasm32\"");
                let allowed = WASM_PLACES.iter().any(|place| relative.starts_with(place));
                assert!(!knows || allowed, "{relative} asks for wasm");
                seen += usize::from(knows);
            }
        }
    }
    assert!(seen > 0, "the search finds nothing, not even where it should");
}
