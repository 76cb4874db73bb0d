//! The licences of what our programs are compiled from: MIT, BSD and their like ask that their texts go along with copies.

use crate::tools;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Name of the file beside a compiled program.
pub const FILE_NAME: &str = "THIRD-PARTY.txt";

/// How the names of licence texts begin, in capitals.
const LICENCE_NAMES: [&str; 6] = ["LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE"];

/// Who wrote the standard library; its sources have no package to read a licence from.
const RUST: &str = "Copyright (c) The Rust Project Contributors";

/// A crate of others.
struct Foreign {
    /// Name and version.
    name: String,
    /// As its manifest says.
    licence: String,
    /// The texts in its package; none where its authors forgot.
    texts: Vec<String>,
    repository: String,
}

/// The licences of all crates that `package` is compiled from for `target` (this machine if `None`), each text once.
///
/// # Errors
/// When cargo fails, or the sources of a crate cannot be read.
pub fn notices(root: &Path, package: &str, target: Option<&str>) -> Result<String> {
    let mut tree = tools::cargo(root);
    tree.args(["tree", "--package", package, "--edges", "normal,no-proc-macro"]);
    tree.args(["--prefix", "none", "--format", "{p}"]);
    tree.args(target.iter().flat_map(|target| ["--target", target]));
    let tree = tools::output(&mut tree).context("cargo tree failed in this workspace")?;
    let metadata = tools::output(tools::cargo(root).args(["metadata", "--format-version", "1"]));
    let metadata = metadata.context("cargo metadata failed in this workspace")?;
    let metadata: Value = serde_json::from_str(&metadata).context("reading what cargo metadata printed")?;
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata lists no packages")?;
    let mut foreign = Vec::new();
    for name in compiled(&tree) {
        let text = |package: &Value, field: &str| package[field].as_str().unwrap_or_default().to_owned();
        let package = packages
            .iter()
            .find(|p| format!("{} {}", text(p, "name"), text(p, "version")) == name)
            .with_context(|| format!("cargo metadata does not know {name}"))?;
        // Ours come from no registry.
        if package["source"].is_null() {
            continue;
        }
        let manifest = text(package, "manifest_path");
        let folder = Path::new(&manifest).parent().context("a manifest without a folder")?;
        foreign.push(Foreign {
            texts: licence_texts(folder)?,
            licence: text(package, "license"),
            repository: text(package, "repository"),
            name,
        });
    }
    if foreign.is_empty() {
        bail!("{package} is compiled from no crates of others: the tree was not read");
    }
    let ours = fs::read_to_string(root.join("LICENSE-MIT")).context("reading LICENSE-MIT")?;
    foreign.push(Foreign {
        name: "the standard library of Rust".to_owned(),
        licence: "MIT OR Apache-2.0".to_owned(),
        texts: vec![with_copyright(&ours, RUST)],
        repository: "https://github.com/rust-lang/rust".to_owned(),
    });
    Ok(joined(package, &foreign))
}

/// The crates in the lines that `cargo tree` prints, each as its name and version.
fn compiled(tree: &str) -> BTreeSet<String> {
    let crates = tree.lines().filter_map(|line| {
        let mut words = line.split_whitespace();
        Some(format!("{} {}", words.next()?, words.next()?.strip_prefix('v')?))
    });
    crates.collect()
}

/// The licence texts in a crate's folder. Where one is MIT's it is enough: the others are at choice, and it names the authors.
fn licence_texts(folder: &Path) -> Result<Vec<String>> {
    let listing = || format!("listing {}", folder.display());
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).with_context(listing)? {
        let entry = entry.with_context(listing)?;
        let name = entry.file_name().to_string_lossy().to_uppercase();
        if LICENCE_NAMES.iter().any(|begin| name.starts_with(begin)) && entry.path().is_file() {
            let text = fs::read(entry.path()).with_context(|| format!("reading {}", entry.path().display()))?;
            let text = String::from_utf8_lossy(&text).replace("\r\n", "\n").trim().to_owned();
            files.insert(name, text);
        }
    }
    let is_mit = |name: &String| name.contains("MIT");
    if files.keys().any(is_mit) {
        files.retain(|name, _| is_mit(name) || name.starts_with("NOTICE"));
    }
    Ok(files.into_values().collect())
}

/// A text of the MIT licence with another line of copyright.
fn with_copyright(mit: &str, copyright: &str) -> String {
    let lines = mit.trim().lines();
    let lines = lines.map(|line| if line.starts_with("Copyright") { copyright } else { line });
    lines.collect::<Vec<_>>().join("\n")
}

/// Each text once, below the names of the crates that it belongs to.
fn joined(package: &str, foreign: &[Foreign]) -> String {
    let mut by_text: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut without = Vec::new();
    for Foreign {
        name,
        licence,
        texts,
        repository,
    } in foreign
    {
        for text in texts {
            by_text.entry(text).or_default().push(format!("{name} ({licence})"));
        }
        if texts.is_empty() {
            without.push(format!("{name} ({licence}), {repository}"));
        }
    }
    let mut parts: Vec<(String, &str)> = by_text
        .into_iter()
        .map(|(text, names)| (names.join("\n"), text))
        .collect();
    parts.sort();
    let mut joined = format!("{package} is compiled from our own crates and from these, under their licences.\n");
    for (names, text) in parts {
        joined += &format!("\n{}\n{names}\n\n{text}\n", "=".repeat(80));
    }
    if !without.is_empty() {
        let rule = "=".repeat(80);
        joined += &format!(
            "\n{rule}\nPackages without a licence text; their repositories have it:\n\n{}\n",
            without.join("\n")
        );
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_are_read_from_the_tree_once() {
        let tree = "deepsft v0.1.0 (/home/me/deepsft)\nglam v0.34.2\nfaer v0.24.4\nglam v0.34.2 (*)\n";
        let names: Vec<String> = compiled(tree).into_iter().collect();
        assert_eq!(names, ["deepsft 0.1.0", "faer 0.24.4", "glam 0.34.2"]);
    }

    #[test]
    fn of_several_licences_that_of_mit_is_taken_and_notices_stay() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("README.md", "no licence");
        assert!(licence_texts(folder.path()).unwrap().is_empty());
        write("LICENSE-APACHE", "apache");
        write("license.txt", "ours\r\n");
        assert_eq!(licence_texts(folder.path()).unwrap(), ["apache", "ours"]);
        write("NOTICE", "notice");
        write("LICENSE-MIT", "mit");
        assert_eq!(licence_texts(folder.path()).unwrap(), ["mit", "notice"]);
    }

    #[test]
    fn a_text_that_several_crates_share_is_there_once_and_a_crate_without_one_is_named() {
        let foreign = |name: &str, texts: &[&str]| Foreign {
            name: name.to_owned(),
            licence: "MIT".to_owned(),
            texts: texts.iter().map(|text| (*text).to_owned()).collect(),
            repository: format!("https://example.org/{name}"),
        };
        let crates = [
            foreign("a 1", &["text of a and b"]),
            foreign("b 2", &["text of a and b"]),
            foreign("c 3", &[]),
        ];
        let joined = joined("ours", &crates);
        assert_eq!(joined.matches("text of a and b").count(), 1);
        assert!(joined.contains("a 1 (MIT)\nb 2 (MIT)\n\ntext of a and b\n"), "{joined}");
        assert!(joined.contains("c 3 (MIT), https://example.org/c 3\n"), "{joined}");
    }

    #[test]
    fn the_text_for_the_standard_library_names_its_authors_and_not_us() {
        let ours = "MIT License\n\nCopyright (c) 2000 us\n\nPermission is granted\n";
        assert_eq!(
            with_copyright(ours, RUST),
            format!("MIT License\n\n{RUST}\n\nPermission is granted")
        );
    }
}
