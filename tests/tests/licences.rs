//! The licences of all crates of others: those that `.cargo/deny.toml` allows, and no other.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use spdx::{Expression, ParseMode};
use std::collections::{BTreeMap, BTreeSet};

/// What `.cargo/deny.toml` says of licences.
struct Policy {
    allowed: BTreeSet<String>,
    /// Of crates whose package names none.
    clarified: BTreeMap<String, String>,
}

impl Policy {
    fn read() -> Self {
        let text = std::fs::read_to_string(deepsft_tests::root().join(".cargo/deny.toml")).unwrap();
        let file: toml::Table = toml::from_str(&text).unwrap();
        let licenses = &file["licenses"];
        let text = |value: &toml::Value| value.as_str().unwrap().to_owned();
        Self {
            allowed: licenses["allow"].as_array().unwrap().iter().map(text).collect(),
            clarified: (licenses["clarify"].as_array().unwrap().iter())
                .map(|entry| (text(&entry["crate"]), text(&entry["expression"])))
                .collect(),
        }
    }

    /// What is wrong with a crate that names this licence.
    fn complaint(&self, name: &str, licence: Option<&str>) -> Option<String> {
        let Some(licence) = licence.or(self.clarified.get(name).map(String::as_str)) else {
            return Some(format!("{name} names no licence"));
        };
        // Old packages write "MIT/Apache-2.0".
        let expression = match Expression::parse_mode(licence, ParseMode::LAX) {
            Ok(expression) => expression,
            Err(error) => return Some(format!("{name}: {error}")),
        };
        let is_allowed = expression.evaluate(|licence| self.allowed.contains(&licence.to_string()));
        (!is_allowed).then(|| format!("{name} is under {licence}, which .cargo/deny.toml does not allow"))
    }
}

#[test]
fn every_crate_is_under_a_licence_that_we_allow() {
    let output = std::process::Command::new(env!("CARGO"))
        .current_dir(deepsft_tests::root())
        // Not offline: what only other systems use may not have been fetched yet.
        .args(["metadata", "--format-version", "1", "--locked"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 500, "the tree was not read");
    let policy = Policy::read();
    let complaint = |package: &Value| policy.complaint(package["name"].as_str().unwrap(), package["license"].as_str());
    let complaints: Vec<String> = packages.iter().filter_map(complaint).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    for name in policy.clarified.keys() {
        let is_there = packages.iter().any(|package| package["name"] == name.as_str());
        assert!(is_there, "{name} is clarified and not used any more");
    }
}

#[test]
fn licences_that_bind_whole_programs_are_refused() {
    let policy = Policy::read();
    let is_allowed = |licence| policy.complaint("a", Some(licence)).is_none();
    for licence in [
        "MIT",
        "MIT/Apache-2.0",
        "GPL-3.0-only OR MIT",
        "Apache-2.0 WITH LLVM-exception",
    ] {
        assert!(is_allowed(licence), "{licence}");
    }
    for licence in [
        "GPL-3.0-only",
        "MIT AND AGPL-3.0-only",
        "LGPL-2.1-or-later",
        "SSPL-1.0",
        "what I like",
    ] {
        assert!(!is_allowed(licence), "{licence}");
    }
    assert!(policy.complaint("a", None).unwrap().contains("names no licence"));
}
