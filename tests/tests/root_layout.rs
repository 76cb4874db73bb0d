//! The repository's root holds what it is meant to hold, and nothing else.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

/// Everything tracked at the top level, dot-files left out.
const ROOT: &[&str] = &[
    "CHANGELOG.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "crates",
    "models",
    "rust-toolchain.toml",
    "rustfmt.toml",
    "tests",
    "wasm-pack.toml",
    "www",
];

#[test]
fn the_top_level_is_as_fixed() {
    let output = std::process::Command::new("git")
        .current_dir(deepsft_tests::root())
        .args(["ls-tree", "--name-only", "HEAD"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let listed = String::from_utf8(output.stdout).unwrap();
    let names: Vec<&str> = listed.lines().filter(|name| !name.starts_with('.')).collect();
    assert_eq!(names, ROOT);
}
