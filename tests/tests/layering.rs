//! The arrows between the crates and between the files of a crate, and what may never reach a browser.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_tests::imports::Imports;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Our crates and the crates of ours each may use. `crates/README.md` draws the same picture.
const ARROWS: &[(&str, &[&str])] = &[
    ("deepsft-geometry", &[]),
    ("deepsft-finding", &["deepsft-geometry"]),
    ("deepsft-calibration", &["deepsft-geometry"]),
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
            "deepsft-calibration",
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
        ],
    ),
    (
        "deepsft-baselines",
        &[
            "deepsft",
            "deepsft-synth",
            "deepsft-train",
            "deepsft-formats",
            "deepsft-geometry",
        ],
    ),
    (
        "deepsft-fuzz",
        &[
            "deepsft",
            "deepsft-synth",
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
    "deepsft-calibration",
    "deepsft-cli",
    "deepsft-lab",
    "deepsft-baselines",
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

/// The Rust files below a folder, by their names from there.
fn sources(folder: &Path) -> BTreeMap<String, String> {
    let (mut folders, mut sources) = (vec![folder.to_owned()], BTreeMap::new());
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(inner).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
                sources.insert(name, std::fs::read_to_string(&path).unwrap());
            }
        }
    }
    sources
}

#[test]
fn a_crate_that_runs_no_tests_or_examples_of_its_sources_has_none() {
    let mut without = 0;
    for package in &packages() {
        for target in package["targets"].as_array().unwrap() {
            let is_library = target["kind"][0] == "lib";
            let sources = sources(Path::new(text(target, "src_path")).parent().unwrap());
            for (wanted, sign) in [("test", "#[test]"), ("doctest", "//! ```"), ("doctest", "/// ```")] {
                if is_library && target[wanted] == false {
                    without += 1;
                    let first = sources.iter().find(|(_, text)| text.contains(sign));
                    assert!(
                        first.is_none(),
                        "{} never runs {:?}",
                        text(package, "name"),
                        first.map(|(name, _)| name)
                    );
                }
            }
        }
    }
    assert!(without > 0, "the targets were not read");
}

/// What goes in circles, until it is mended. A circle that is no more has to leave the list.
const CIRCLES: &[&str] = &[];

#[test]
fn inside_a_crate_no_two_files_and_no_two_folders_import_each_other() {
    let (mut circles, mut seen) = (BTreeSet::new(), 0);
    for package in packages().iter().filter(|p| text(p, "name") != "deepsft-tests") {
        let name = text(package, "name");
        let sources = sources(&Path::new(text(package, "manifest_path")).with_file_name("src"));
        let imports = Imports::of(sources.iter().map(|(name, text)| (name.as_str(), text.as_str())));
        seen += imports.files.values().map(BTreeSet::len).sum::<usize>();
        let found = imports.mutual().into_iter().chain(imports.circles_of_folders());
        circles.extend(found.map(|circle| format!("{name}: {circle}")));
    }
    assert!(seen > 500, "only {seen} imports were seen: the sources were not read");
    let listed: BTreeSet<String> = CIRCLES.iter().map(|circle| (*circle).to_owned()).collect();
    let new: Vec<_> = circles.difference(&listed).collect();
    assert!(new.is_empty(), "these import each other: {new:#?}");
    let mended: Vec<_> = listed.difference(&circles).collect();
    assert!(
        mended.is_empty(),
        "these are circles no more, and have to leave the list: {mended:#?}"
    );
}

#[test]
fn circles_are_seen_through_re_exports_and_parents_and_what_is_none_is_not() {
    let of = |sources: &[(&'static str, &'static str)]| {
        let imports = Imports::of(sources.iter().copied());
        (imports.mutual().join(", "), imports.circles_of_folders().join(", "))
    };
    let pair = |a: &str, b: &str| (format!("{a} <-> {b}"), String::new());
    let none = (String::new(), String::new());
    let lib = (
        "lib.rs",
        "mod a; mod b; pub use a::{A, Other as Renamed}; pub use b::B;",
    );
    // By paths of the crate, of the parent, in the middle of a text, and through re-exports with another name.
    for [a, b] in [
        ["use crate::b::B;", "use crate::a::A;"],
        ["use super::b::B;", "fn f() { super::a::g(1) }"],
        ["use std::fmt; use crate::{b::{C, D}, Renamed};", "use crate::Renamed;"],
        ["pub fn f() -> crate::B { 1 }", "use super::{A, Renamed};"],
        [
            "const QUOTE: char = '\"'; use crate::B;",
            "const S: &str = \"\\\"\"; use crate::A;",
        ],
    ] {
        assert_eq!(of(&[lib, ("a.rs", a), ("b.rs", b)]), pair("a.rs", "b.rs"), "{a} {b}");
    }
    // One direction, other crates, comments, texts, tests, a re-export.
    for b in [
        "use other::a::A; use std::a::A;",
        "// use crate::a::A;\nfn f() {}",
        "const S: &str = \"use crate::a::A;\";",
        "fn f() {}\n#[cfg(test)]\nmod tests { use crate::a::A; }",
        "pub(crate) use crate::a::A;",
    ] {
        assert_eq!(of(&[lib, ("a.rs", "use crate::b::B;"), ("b.rs", b)]), none, "{b}");
    }
    // A module and its child; the child of a folder's `mod.rs`.
    let (own, child) = ("mod c; use c::C; pub struct A;", "use super::A;");
    assert_eq!(of(&[lib, ("a.rs", own), ("a/c.rs", child)]), pair("a.rs", "a/c.rs"));
    assert_eq!(
        of(&[lib, ("a/mod.rs", own), ("a/c.rs", child)]),
        pair("a/c.rs", "a/mod.rs")
    );
    assert_eq!(
        of(&[lib, ("a.rs", "mod c; pub use c::C; pub struct A;"), ("a/c.rs", child)]),
        none
    );
    // Folders by different files, three of them in a ring.
    let ring = [
        ("a/x.rs", "use crate::b::y;"),
        ("b/y.rs", "use crate::c::z;"),
        ("c/z.rs", ""),
        ("c/w.rs", "use crate::a::x;"),
    ];
    assert_eq!(of(&ring).1, "a/ <-> b/ <-> c/");
    assert_eq!(of(&ring[..3]), none);
}

/// Where `cfg(target_family = "wasm")` may stand.
const WASM_PLACES: &[&str] = &["deepsft-inference/src/cpu/team/mod.rs", "deepsft-web/"];

#[test]
fn only_devices_threads_and_the_bindings_know_that_there_is_wasm() {
    let mut seen = 0;
    for (name, text) in sources(&deepsft_tests::root().join("crates")) {
        let knows = text.contains("target_family = \"wasm\"") || text.contains("target_arch = \"wasm32\"");
        let allowed = WASM_PLACES.iter().any(|place| name.starts_with(place));
        assert!(!knows || allowed, "{name} asks for wasm");
        seen += usize::from(knows);
    }
    assert!(seen > 0, "the search finds nothing, not even where it should");
}
