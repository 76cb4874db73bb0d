//! The pages people read: their links lead somewhere, none is forgotten, and the README stays short.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};

/// What fits on a few screens. What is longer belongs to `www/docs/`.
const README_LINES: usize = 130;

/// A page of the repository.
struct Page {
    path: PathBuf,
    text: String,
}

fn page(path: PathBuf) -> Page {
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Page { path, text }
}

/// All Markdown pages for readers, sorted.
fn pages() -> Vec<Page> {
    let root = deepsft_tests::root().canonicalize().unwrap();
    let mut pages: Vec<PathBuf> = ["README.md", "CHANGELOG.md", "www/README.md"]
        .map(|name| root.join(name))
        .into();
    let crates = fs::read_dir(root.join("crates")).unwrap();
    for path in crates.map(|entry| entry.unwrap().path()) {
        if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        } else if path.join("README.md").is_file() {
            pages.push(path.join("README.md"));
        }
    }
    let mut folders = vec![root.join("www/docs"), root.join("models")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages.into_iter().map(page).collect()
}

/// The lines outside of code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut inside = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        !inside && !fence
    })
}

/// The targets of `[text](target)` and `![text](target)` that lie in this repository.
fn links(text: &str) -> Vec<&str> {
    let targets = prose(text).flat_map(|line| {
        line.split("](")
            .skip(1)
            .filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
    });
    targets.filter(|target| !target.contains("://")).collect()
}

/// The anchors that GitHub gives to the headings of a page.
fn anchors(text: &str) -> Vec<String> {
    let headings =
        prose(text).filter_map(|line| line.strip_prefix('#').map(|rest| rest.trim_start_matches('#').trim()));
    headings
        .map(|heading| {
            let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.collect::<String>().to_lowercase().replace(' ', "-")
        })
        .collect()
}

#[test]
fn every_link_leads_to_a_file_and_every_anchor_to_a_heading() {
    let (mut followed, mut broken) = (0, Vec::new());
    for Page { path, text } in pages() {
        for link in links(&text) {
            let (file, anchor) = link
                .split_once('#')
                .map_or((link, None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() {
                path.clone()
            } else {
                path.parent().unwrap().join(file)
            };
            let leads = match anchor {
                None => target.exists(),
                Some(anchor) => target.is_file() && anchors(&page(target).text).iter().any(|known| known == anchor),
            };
            if !leads {
                broken.push(format!("{}: {link}", path.display()));
            }
            followed += 1;
        }
    }
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
    assert!(
        followed > 50,
        "only {followed} links were seen: the pages were not read"
    );
}

#[test]
fn the_index_of_the_docs_names_every_page() {
    let docs = deepsft_tests::root().join("www/docs").canonicalize().unwrap();
    let index = page(docs.join("index.md"));
    let linked: Vec<PathBuf> = links(&index.text).iter().map(|link| docs.join(link)).collect();
    for Page { path, .. } in pages() {
        let listed = path.parent() != Some(Path::new(&docs)) || path == index.path || linked.contains(&path);
        assert!(listed, "index.md does not name {}", path.display());
    }
}

#[test]
fn the_readme_is_short() {
    let lines = page(deepsft_tests::root().join("README.md")).text.lines().count();
    assert!(lines <= README_LINES, "{lines} lines, at most {README_LINES}");
}
