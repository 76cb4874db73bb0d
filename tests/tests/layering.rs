//! The arrows between the crates, and what may never reach a browser.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Our crates and the crates of ours each may use. `crates/README.md` draws the same picture.
const ARROWS: &[(&str, &[&str])] = &[
    ("deepsft-geometry", &[]),
    ("deepsft-finding", &["deepsft-geometry"]),
    ("deepsft-formats", &["deepsft-geometry"]),
    ("deepsft-inference", &["deepsft-geometry"]),
    (
        "deepsft",
        &[
            "deepsft-finding",
            "deepsft-formats",
            "deepsft-geometry",
            "deepsft-inference",
        ],
    ),
    ("deepsft-network", &["deepsft-geometry", "deepsft-inference"]),
    ("deepsft-synth", &["deepsft-formats", "deepsft-geometry"]),
    (
        "deepsft-train",
        &[
            "deepsft",
            "deepsft-network",
            "deepsft-synth",
            "deepsft-formats",
            "deepsft-geometry",
        ],
    ),
    (
        "deepsft-cli",
        &[
            "deepsft",
            "deepsft-network",
            "deepsft-synth",
            "deepsft-train",
            "deepsft-formats",
            "deepsft-geometry",
        ],
    ),
    (
        "deepsft-lab",
        &[
            "deepsft",
            "deepsft-network",
            "deepsft-synth",
            "deepsft-train",
            "deepsft-finding",
            "deepsft-formats",
            "deepsft-geometry",
            "deepsft-cli",
        ],
    ),
    (
        "deepsft-fuzz",
        &[
            "deepsft",
            "deepsft-network",
            "deepsft-synth",
            "deepsft-train",
            "deepsft-formats",
            "deepsft-geometry",
            "deepsft-cli",
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
    "deepsft-lab",
    "deepsft-fuzz",
    "clap",
    "anyhow",
    "rayon",
    "tar",
    "indicatif",
    "burn",
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

/// What is wrong with the dependency `dependency` (as `cargo metadata` describes it) of a crate that others depend on.
fn complaint(dependency: &Value) -> Option<String> {
    let (used, version) = (text(dependency, "name"), text(dependency, "req"));
    if text(dependency, "source").starts_with("git") {
        Some(format!("{used} comes from git"))
    } else if version.contains('=') {
        Some(format!("{used} is pinned: {version}"))
    } else if version == "*" {
        Some(format!("{used} has no version"))
    } else {
        None
    }
}

#[test]
fn dependencies_take_any_compatible_version_and_none_comes_from_git() {
    // Exact versions are Cargo.lock's: nobody could use a library that pins beside another that needs a newer patch.
    let mut seen = 0;
    for package in &packages() {
        for dependency in dependencies(package).iter().filter(|d| d["path"].is_null()) {
            seen += 1;
            let complaint = complaint(dependency);
            assert!(complaint.is_none(), "{}: {}", text(package, "name"), complaint.unwrap());
        }
    }
    assert!(seen > 50, "the dependencies were not read");
    let dependency = |req: &str, source: &str| serde_json::json!({"name": "glam", "req": req, "source": source});
    let registry = "registry+https://example.org";
    assert_eq!(complaint(&dependency("^0.34.2", registry)), None);
    assert!(complaint(&dependency("=0.34.2", registry)).unwrap().contains("pinned"));
    assert!(complaint(&dependency("*", registry)).unwrap().contains("no version"));
    let git = dependency("*", "git+https://example.org/glam");
    assert!(complaint(&git).unwrap().contains("git"));
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
        names.contains("deepsft") && names.contains("deepsft-inference"),
        "the tree was not read"
    );
    for name in NEVER_IN_THE_BROWSER {
        assert!(!names.contains(name), "{name} reaches the browser");
    }
}

/// Where `cfg(target_family = "wasm")` may stand.
const WASM_PLACES: &[&str] = &["crates/deepsft-inference/src/cpu/bands.rs", "crates/deepsft-web/"];

#[test]
fn only_devices_threads_and_the_bindings_know_that_there_is_wasm() {
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
