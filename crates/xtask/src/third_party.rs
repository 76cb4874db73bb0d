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

/// What stands in place of a text that a package lacks.
const NO_TEXT: &str = "Their packages hold no licence text; their repositories have it.";

/// The licences of all crates that `package` is compiled from for `target` (this machine if `None`), each text once.
pub fn notices(root: &Path, package: &str, target: Option<&str>) -> Result<String> {
    let mut tree = tools::cargo(root);
    tree.args(["tree", "--package", package, "--edges", "normal,no-proc-macro"]);
    tree.args(["--prefix", "none", "--format", "{p}"]);
    tree.args(target.iter().flat_map(|target| ["--target", target]));
    let tree = tools::output(&mut tree).context("cargo tree failed in this workspace")?;
    let metadata = tools::metadata(root, &[])?;
    let packages = metadata["packages"].as_array();
    let packages = packages.context("cargo metadata lists no packages")?;
    // Headings, which have the repository too, for some licences ask to say where the sources are; and texts.
    let mut foreign = Vec::new();
    for name in compiled(&tree) {
        let text = |package: &Value, field: &str| package[field].as_str().unwrap_or_default().to_owned();
        let package = packages
            .iter()
            .find(|p| format!("{} {}", text(p, "name"), text(p, "version")) == name)
            .with_context(|| format!("cargo metadata does not know {name}"))?;
        // Ours come from no registry.
        if !package["source"].is_null() {
            let manifest = text(package, "manifest_path");
            let folder = Path::new(&manifest).parent().context("a manifest without a folder")?;
            let (licence, repository) = (text(package, "license"), text(package, "repository"));
            let texts = licence_texts(folder, &licence)?;
            foreign.push((format!("{name} ({licence}) {repository}"), texts));
        }
    }
    if foreign.is_empty() {
        bail!("{package} is compiled from no crates of others: the tree was not read");
    }
    let ours = fs::read_to_string(root.join("LICENSE-MIT")).context("reading LICENSE-MIT")?;
    let standard = "the standard library of Rust (MIT OR Apache-2.0) https://github.com/rust-lang/rust".to_owned();
    foreign.push((standard, vec![with_copyright(&ours, RUST)]));
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

/// The licence texts in the folder of a crate under `licence`. Where MIT's is one to choose it is enough, and it names the authors.
fn licence_texts(folder: &Path, licence: &str) -> Result<Vec<String>> {
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
    if !licence.contains(" AND ") && files.keys().any(is_mit) {
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

/// Each text once, below the headings of the crates that it belongs to.
fn joined(package: &str, foreign: &[(String, Vec<String>)]) -> String {
    let mut by_text: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (heading, texts) in foreign {
        for text in texts {
            by_text.entry(text).or_default().push(heading);
        }
        if texts.is_empty() {
            by_text.entry(NO_TEXT).or_default().push(heading);
        }
    }
    let parts = by_text.into_iter().map(|(text, headings)| (headings.join("\n"), text));
    let mut parts: Vec<_> = parts.collect();
    parts.sort_by_key(|(headings, text)| (*text == NO_TEXT, headings.clone()));
    let rule = "=".repeat(80);
    let parts = parts
        .iter()
        .map(|(headings, text)| format!("\n{rule}\n{headings}\n\n{text}\n"));
    let begin = format!("{package} is compiled from our own crates and from these, under their licences.\n");
    begin + &parts.collect::<String>()
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
    fn of_licences_to_choose_from_that_of_mit_is_taken_and_notices_stay() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        let texts = |licence: &str| licence_texts(folder.path(), licence).unwrap();
        write("README.md", "no licence");
        assert!(texts("MIT OR Apache-2.0").is_empty());
        write("LICENSE-APACHE", "apache");
        write("license.txt", "ours\r\n");
        assert_eq!(texts("MIT OR Apache-2.0"), ["apache", "ours"]);
        write("NOTICE", "notice");
        write("LICENSE-MIT", "mit");
        assert_eq!(texts("MIT OR Apache-2.0"), ["mit", "notice"]);
        assert_eq!(texts("MIT AND Apache-2.0"), ["apache", "mit", "ours", "notice"]);
    }

    #[test]
    fn a_text_that_several_crates_share_is_there_once_and_a_crate_without_one_is_named() {
        let foreign =
            |heading: &str, texts: &[&str]| (heading.to_owned(), texts.iter().map(ToString::to_string).collect());
        let shared = ["text of a and b"];
        let joined = joined(
            "ours",
            &[foreign("a 1", &shared), foreign("b 2", &shared), foreign("c 3", &[])],
        );
        assert_eq!(joined.matches(shared[0]).count(), 1);
        assert!(joined.contains("\na 1\nb 2\n\ntext of a and b\n"), "{joined}");
        assert!(
            joined.contains("\nc 3\n\nTheir packages hold no licence text"),
            "{joined}"
        );
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
